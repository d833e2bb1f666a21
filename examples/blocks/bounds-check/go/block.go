// Bounds check with hysteresis.
package main

import (
	"errors"
	"math"
)

var settings Settings

var state Retained

func Defaults() Settings {
	return Settings{LowLimit: 10, HighLimit: 50, Hysteresis: 1}
}

func Configure(next Settings) error {
	switch {
	case !finite(next.LowLimit):
		return errors.New("low-limit must be a finite number")
	case !finite(next.HighLimit):
		return errors.New("high-limit must be a finite number")
	case next.LowLimit >= next.HighLimit:
		return errors.New("low-limit must be below high-limit")
	case !finite(next.Hysteresis) || next.Hysteresis < 0:
		return errors.New("hysteresis must be a finite number, 0 or more")
	}
	settings = next
	return nil
}

func finite(x float64) bool { return !math.IsNaN(x) && !math.IsInf(x, 0) }

func Execute(scan Scan, inputs Inputs) (outputs Outputs) {
	signal := inputs.Signal
	if math.IsNaN(signal) {
		outputs.Error = true
	} else {
		above, below := signal > settings.HighLimit, signal < settings.LowLimit
		// Beyond one limit, the other flag goes whatever the hysteresis.
		state.High = above || (state.High && !below && signal >= settings.HighLimit-settings.Hysteresis)
		state.Low = below || (state.Low && !above && signal <= settings.LowLimit+settings.Hysteresis)
	}
	outputs.High, outputs.Low = state.High, state.Low
	return
}

func Save() Retained { return state }

func Restore(saved Retained) { state = saved }
