// Asks Go's library for the time and for random numbers.
package main

import (
	"math/rand/v2"
	"time"
)

func Execute(scan Scan, inputs Inputs) (outputs Outputs) {
	if inputs.Time {
		outputs.Now = uint64(time.Now().UnixNano())
	}
	if inputs.Random {
		outputs.Random = rand.Uint32()
	}
	return
}
