/** A stream of bytes to and from a controller, whatever carries it. */
export interface Transport {
  /** For people: "USB serial port", "192.168.1.20". */
  readonly name: string;
  readonly isSerial: boolean;
  /** Open it. Rejects with a LinkError that says what to do. */
  open(events: TransportEvents): Promise<void>;
  /** Send; resolves when the bytes were taken, rejects when the link is gone. */
  write(bytes: Uint8Array): Promise<void>;
  /** End it; no event follows. */
  close(): Promise<void>;
}

export interface TransportEvents {
  bytes(data: Uint8Array): void;
  /** The link has ended by itself: unplugged, switched off, out of reach. */
  lost(why: string): void;
}

/** The link, in words for people, and what to do about it. */
export class LinkError extends Error {
  constructor(
    message: string,
    readonly hint = "",
  ) {
    super(message);
  }
}
