import { male } from "dynaskin-male";
import { showWorker } from "./show-worker.js";

showWorker({ model: male });
