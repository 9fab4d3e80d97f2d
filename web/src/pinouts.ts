/** The pictures of the boards (made from the board files), as files next to the page. */
const urls = import.meta.glob<string>("../../build/generated/pinout/*.svg", { query: "?url", import: "default", eager: true });

/** "" for a board without a picture. */
export function pinoutUrl(id: string): string {
  return urls[`../../build/generated/pinout/${id}.svg`] ?? "";
}
