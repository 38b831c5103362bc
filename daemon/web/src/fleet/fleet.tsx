import { render } from "preact";
import { FleetApp } from "./app";

const place = document.getElementById("app");
if (place) {
  place.replaceChildren();
  render(<FleetApp />, place);
}
