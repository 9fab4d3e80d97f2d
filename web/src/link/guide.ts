/** Figures of the set-up guide, and what it remembers. Pure. */

/** A motor that turns a screw, a pinion or a pulley. */
export function stepsPerMm(fullSteps: number, microsteps: number, mmPerTurn: number): number {
  return (fullSteps * microsteps) / mmPerTurn;
}

/** The machine moved another distance than it should have. */
export function corrected(stepsNow: number, asked_mm: number, measured_mm: number): number {
  return (stepsNow * asked_mm) / measured_mm;
}

/** The mask with the bit of this axis changed. */
export function flipped(mask: number, axis: number): number {
  return mask ^ (1 << axis);
}

/** "40,5" as "40.5": a number above 0; null: it is not. */
export function measure(text: string): number | null {
  const value = Number(text.trim().replace(",", "."));
  return text.trim() !== "" && Number.isFinite(value) && value > 0 ? value : null;
}

/** What is left for the next visit of this controller. */
export interface Progress {
  step: number;
  /** "$100: 250.000 → 800.000", the newest last. */
  written: string[];
}

export function readProgress(text: string | null, steps: number): Progress {
  try {
    const { step, written } = JSON.parse(text ?? "") as Progress;
    if (Number.isInteger(step) && step >= 0 && step < steps && Array.isArray(written)) return { step, written: written.map(String) };
  } catch {
    // none, or of another version
  }
  return { step: 0, written: [] };
}
