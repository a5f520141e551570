import * as dynaskin from "dynaskin";
import { show } from "./show.js";

show(dynaskin);
