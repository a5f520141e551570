"use client";
import { useEffect } from "react";
import { showWorker } from "../../../src/show-worker.js";

export function WorkerHop() {
  useEffect(() => {
    showWorker();
  }, []);
  return <p>A worker hops.</p>;
}
