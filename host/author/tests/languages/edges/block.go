// Whole numbers at their edges.
package main

import "math"

var least = Whole{C: math.MinInt8, E: math.MinInt16, G: math.MinInt32, I: math.MinInt64}

var most = Whole{
	B: math.MaxUint8, C: math.MaxInt8, D: math.MaxUint16, E: math.MaxInt16,
	F: math.MaxUint32, G: math.MaxInt32, H: math.MaxUint64, I: math.MaxInt64,
}

var current Settings

var retained Retained

func Configure(settings Settings) error {
	current = settings
	return nil
}

func Execute(scan Scan, inputs Inputs) (outputs Outputs) {
	w := inputs.Whole
	outputs.Upper = Upper{
		B: w.B > math.MaxInt8, C: w.C < 0, D: w.D > math.MaxInt16, E: w.E < 0,
		F: w.F > math.MaxInt32, G: w.G < 0, H: w.H > math.MaxInt64, I: w.I < 0,
	}
	switch inputs.Ask {
	case AskLeast:
		outputs.Whole = least
	case AskMost:
		outputs.Whole = most
	case AskSettings:
		outputs.Whole = current.Whole
	case AskKept:
		outputs.Whole = retained.Whole
	default:
		outputs.Whole, retained.Whole = w, w
	}
	return
}

func Save() Retained { return retained }

func Restore(state Retained) { retained = state }
