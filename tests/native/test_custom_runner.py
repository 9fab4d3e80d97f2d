"""How PlatformIO reads our C tests: a line says what failed, the last one how many did."""

from __future__ import annotations

import re

from platformio.test.result import TestCase, TestStatus
from platformio.test.runners.base import TestRunnerBase


class CustomTestRunner(TestRunnerBase):
    """The program's own lines are its failures; without a last line that counts them it has crashed."""

    def __init__(self, *args: object, **kwargs: object) -> None:
        super().__init__(*args, **kwargs)
        self.said: list[str] = []

    def on_testing_line_output(self, line: str) -> None:
        said = line.strip()
        count = re.fullmatch(r"(\d+) failures", said)
        if count is None:
            self.said += [said] if said else []
            return
        status = TestStatus.PASSED if count[1] == "0" else TestStatus.FAILED
        name = self.test_suite.test_name
        self.test_suite.add_case(TestCase(name, status, "\n".join(self.said), stdout="\n".join([*self.said, said])))
        self.test_suite.on_finish()
