import { showWorker } from "./show-worker.js";

showWorker();
