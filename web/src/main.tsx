import { render } from "preact";
import "./styles.css";
import { start } from "./app";
import { startKeeping } from "./keeping";
import { startLanguage } from "./language";
import { startOffline } from "./offline";
import { guardPresses } from "./press";
import { App } from "./view/app";

void startLanguage().then(() => {
  render(<App />, document.getElementById("app")!);
  guardPresses();
  void startKeeping();
  void start();
  startOffline();
});
