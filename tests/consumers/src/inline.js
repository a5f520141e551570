import * as dynaskin from "dynaskin/inline";
import { male } from "dynaskin-male/inline";
import { show } from "./show.js";

show(dynaskin, male);
