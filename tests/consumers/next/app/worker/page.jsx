import { WorkerHop } from "./worker-hop.jsx";

export default function Page() {
  return <WorkerHop />;
}
