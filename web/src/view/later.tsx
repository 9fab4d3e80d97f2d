/** Parts of the page that come with their first use: what opens the page stays small. */
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { fail } from "../app";
import { t } from "../words";

/** A component that is loaded when it is shown first. A load that fails is reported, and is tried again when it is shown again. */
export function later<P extends object>(load: () => Promise<(props: P) => JSX.Element>): (props: P) => JSX.Element {
  const loaded = signal<((props: P) => JSX.Element) | null>(null);
  let isLoading = false;
  return (props) => {
    const View = loaded.value;
    if (View) return <View {...props} />;
    if (!isLoading) {
      isLoading = true;
      load()
        .then((view) => (loaded.value = view), fail)
        .finally(() => (isLoading = false));
    }
    return <p class="soft">{t`Loading`}</p>;
  };
}
