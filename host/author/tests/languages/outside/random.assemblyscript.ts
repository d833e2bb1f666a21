// Asks AssemblyScript for random numbers.
import { Scan, Inputs, Outputs } from "./class";

export function execute(scan: Scan, inputs: Inputs, outputs: Outputs): void {
  outputs.now = 0;
  outputs.random = inputs.random ? <u32>(Math.random() * 4294967296.0) : 0;
}
