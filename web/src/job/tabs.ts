/** Several tabs of one browser: which of them has a job. A job is of one tab, and others leave it alone. */

/** A tab that is there answers sooner, even one in the background. */
const ANSWER_MS = 500;
const CHANNEL = "wificnc-job";

type Said = { asks: string } | { has: string };

export class Tabs {
  private readonly channel = typeof BroadcastChannel === "undefined" ? null : new BroadcastChannel(CHANNEL);
  private heard: (id: string) => void = () => {};

  /** @param has  whether this tab has the job of this id */
  constructor(has: (id: string) => boolean) {
    if (!this.channel) return;
    this.channel.onmessage = ({ data }: MessageEvent<Said>) => {
      if ("has" in data) this.heard(data.has);
      else if (has(data.asks)) this.channel?.postMessage({ has: data.asks } satisfies Said);
    };
  }

  /** Whether another tab that is open has this job. One question at a time. */
  async elsewhere(id: string): Promise<boolean> {
    if (!this.channel) return false;
    return new Promise((resolve) => {
      const end = (is: boolean): void => {
        clearTimeout(timer);
        this.heard = () => {};
        resolve(is);
      };
      const timer = setTimeout(() => end(false), ANSWER_MS);
      this.heard = (other) => other === id && end(true);
      this.channel?.postMessage({ asks: id } satisfies Said);
    });
  }

  close(): void {
    this.channel?.close();
  }
}
