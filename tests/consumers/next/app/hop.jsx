"use client";
// Imported on the server too, together with an adapter; avatars are made in the browser.
import * as dynaskin from "dynaskin";
import { DynaSkin } from "dynaskin/three";
import { female } from "dynaskin-female";
import { useEffect } from "react";
import { show } from "../../src/show.js";

export function Hop() {
  useEffect(() => {
    show(dynaskin, female);
  }, []);
  return <p>{`the adapter is a ${typeof DynaSkin}`}</p>;
}
