import "dynaskin/worker/thread";
