// The list of runs for whoever looks at it and starts none.
import "./errors.js";
import { following } from "./runs_live.js";

following();
