import * as dynaskin from "dynaskin/inline";
import { show } from "./show.js";

show(dynaskin);
