/** Motor drivers with registers and drives on RS-485, on boards that have them: how they are, and their settings. */
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { controller } from "../app";
import { driversOf, spindlesOf, type Driver, type Spindle } from "../link/drives";
import { settingNumber } from "../tables";
import { later } from "./later";

// Few boards have both, and many none.
const DriversCard = later(async () => (await import("./drivers")).DriversCard);
const SpindleCard = later(async () => (await import("./spindle")).SpindleCard);
const SPINDLE_TYPE = settingNumber("spindle_type");
const LOOK_MS = 1000;
const drivers = signal<readonly Driver[]>([]);
const spindles = signal<readonly Spindle[]>([]);
/** Controller and $395 of which the list of spindles is. */
let listed = "";

/** Drivers are asked for as long as they are shown; spindles again after another one was chosen. */
async function look(): Promise<void> {
  const rows = await controller.query("$DRIVERS");
  if (rows) drivers.value = driversOf(rows);
  const now = `${controller.linkName.peek()} ${controller.settings.peek().get(SPINDLE_TYPE) ?? ""}`;
  if (!rows || now === listed) return;
  const names = await controller.query("$SPINDLES");
  if (names) [spindles.value, listed] = [spindlesOf(names), now];
}

export function Drives(): JSX.Element {
  useEffect(() => {
    const timer = setInterval(() => void look(), LOOK_MS);
    void look();
    return () => clearInterval(timer);
  }, []);
  return (
    <>
      {drivers.value.length > 0 && <DriversCard drivers={drivers.value} />}
      {spindles.value.some(({ drive }) => drive) && <SpindleCard spindles={spindles.value} />}
    </>
  );
}
