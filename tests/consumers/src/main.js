import * as dynaskin from "dynaskin";
import { female } from "dynaskin-female";
import { show } from "./show.js";

show(dynaskin, female);
