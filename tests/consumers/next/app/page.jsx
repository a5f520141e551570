// Rendered on the server, which imports the package as well.
import { PROCEDURAL_MOTIONS, VERSION } from "dynaskin";
import { Hop } from "./hop.jsx";

export default function Page() {
  return (
    <main>
      <p>{`dynaskin ${VERSION} knows ${PROCEDURAL_MOTIONS.length} motions`}</p>
      <Hop />
    </main>
  );
}
