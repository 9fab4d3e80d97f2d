"""A bill of materials as SPDX 2.3 JSON: what was released, what it was made of, what it needs. Pure."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from typing import Any

from wificnc.firmware.release.plan import Asset, Source

DOCUMENT, PRODUCT = "SPDXRef-DOCUMENT", "SPDXRef-wificnc"
PURPOSES = {"image": "FIRMWARE", "package": "INSTALL", "source": "SOURCE", "component": "ARCHIVE", "page": "ARCHIVE"}
REQUIREMENT = re.compile(r"^([A-Za-z0-9._-]+)\s*([^;]*)")
NO_ANSWER = "NOASSERTION"


@dataclass(frozen=True)
class Part:
    """Something of others."""

    purl: str  # package URL without a version
    name: str
    version: str  # "": whatever satisfies the requirement
    licence: str
    relation: str  # of the asset to it, a relationship type of SPDX
    users: tuple[str, ...]  # names of assets


@dataclass(frozen=True)
class Materials:
    """What the release is made of."""

    assets: Sequence[tuple[Asset, str]]  # with its SHA-256
    parts: Sequence[Part] = field(default_factory=tuple)
    copyright: str = NO_ANSWER


def python_parts(requirements: Sequence[str], users: tuple[str, ...]) -> list[Part]:
    """Of [project] dependencies in pyproject.toml."""
    found = [match for text in requirements if (match := REQUIREMENT.match(text))]
    return [Part(f"pkg:pypi/{match[1].lower()}", match[1], "", NO_ANSWER, "DEPENDS_ON", users) for match in found]


def npm_parts(lock: Mapping[str, Any], users: tuple[str, ...]) -> list[Part]:
    """Of a package-lock.json: what the built page has in it."""
    rows = lock.get("packages", {}).items()
    return [
        Part(
            f"pkg:npm/{name.replace('@', '%40')}", name, str(row["version"]), str(row.get("license", NO_ANSWER)),
            "CONTAINS", users,
        )
        for path, row in rows
        if (name := path.rpartition("node_modules/")[2]) and not row.get("dev") and "version" in row
    ]  # fmt: skip


def platform_part(platformio_ini: str, users: tuple[str, ...]) -> list[Part]:
    """ESP-IDF, as PlatformIO's platform of this version brings it."""
    match = re.search(r"^platform = (espressif32)@(\S+)$", platformio_ini, re.MULTILINE)
    if match is None or not users:
        return []
    return [Part("pkg:generic/platformio-espressif32", match[1], match[2], "Apache-2.0", "STATIC_LINK", users)]


def document(source: Source, materials: Materials) -> bytes:
    """The SPDX document."""
    packages = [_product(source, materials.copyright)]
    relations = [(DOCUMENT, "DESCRIBES", PRODUCT)]
    for asset, sha256 in materials.assets:
        packages.append(_asset_package(asset, sha256, source))
        relations += [(DOCUMENT, "DESCRIBES", _id(asset.name)), (_id(asset.name), "GENERATED_FROM", PRODUCT)]
    for part in sorted(materials.parts, key=lambda part: (part.purl, part.version)):
        packages.append(_part_package(part))
        relations += [(_id(user), part.relation, _part_id(part)) for user in part.users]
    body = json.dumps([packages, relations], sort_keys=True)
    value = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": DOCUMENT,
        "name": f"wificnc-{source.version}",
        "documentNamespace": f"https://spdx.org/spdxdocs/wificnc-{source.version}-{_sha256(body)[:32]}",
        "creationInfo": {"created": utc(source.epoch_s), "creators": [f"Tool: wificnc-{source.version}"]},
        "packages": packages,
        "relationships": [
            {"spdxElementId": one, "relationshipType": kind, "relatedSpdxElement": other}
            for one, kind, other in relations
        ],
    }
    return (json.dumps(value, indent=2, ensure_ascii=False) + "\n").encode()


def utc(epoch_s: int) -> str:
    return datetime.fromtimestamp(epoch_s, timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")


def _product(source: Source, copyright_text: str) -> dict[str, Any]:
    return {
        **_package(PRODUCT, "wificnc", source.version, "MIT"),
        "copyrightText": copyright_text,
        "sourceInfo": f"commit {source.revision}",
        "primaryPackagePurpose": "SOURCE",
    }


def _asset_package(asset: Asset, sha256: str, source: Source) -> dict[str, Any]:
    return {
        **_package(_id(asset.name), asset.name, source.version, NO_ANSWER if asset.kind == "image" else "MIT"),
        "packageFileName": asset.name,
        "primaryPackagePurpose": PURPOSES.get(asset.kind, "FILE"),
        "checksums": [{"algorithm": "SHA256", "checksumValue": sha256}],
    }


def _part_package(part: Part) -> dict[str, Any]:
    locator = f"{part.purl}@{part.version}" if part.version else part.purl
    reference = {"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": locator}
    return {
        **_package(_part_id(part), part.name, part.version, part.licence),
        "primaryPackagePurpose": "LIBRARY",
        "externalRefs": [reference],
    }


def _package(spdx_id: str, name: str, version: str, licence: str) -> dict[str, Any]:
    return {
        "SPDXID": spdx_id,
        "name": name,
        **({"versionInfo": version} if version else {}),
        "downloadLocation": NO_ANSWER,
        "filesAnalyzed": False,
        "licenseConcluded": licence,
        "licenseDeclared": licence,
        "copyrightText": NO_ANSWER,
    }


def _id(name: str) -> str:
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name)


def _part_id(part: Part) -> str:
    """Two names may look alike without their signs."""
    return f"{_id(part.name)}-{_sha256(part.purl + part.version)[:8]}"


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
