/** An address that needs no login. */
export interface Trusted {
  /** By which the controller is asked to end it. */
  number: number;
  address: string;
  /** null: for ever */
  seconds: number | null;
}

const TRUST = /^\[TRUST:(\d),([0-9a-f.:]+),(always|\d+)\]$/;

/** What $TRUST answers. */
export function trustedOf(said: readonly string[]): Trusted[] {
  return said.flatMap((line) => {
    const [, number, address, left] = TRUST.exec(line) ?? [];
    if (address === undefined) return [];
    return [{ number: Number(number), address, seconds: left === "always" ? null : Number(left) }];
  });
}
