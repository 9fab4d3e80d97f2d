import { render } from "preact";
import "./styles.css";
import { start } from "./app";
import { startKeeping } from "./keeping";
import { App } from "./view/app";

render(<App />, document.getElementById("app")!);
void startKeeping();
void start();
