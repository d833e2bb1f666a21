// A motor with a contactor: started and stopped by command, supervised by its feedback.
package main

import (
	"errors"
	"time"
)

var (
	timeout  time.Duration
	retained Retained
	run      bool
	alarms   Alarms
	// How long the feedback has not been as run wants it.
	waiting time.Duration
)

func Configure(next Settings) error {
	if next.FeedbackTimeout.Ns == 0 {
		return errors.New("feedback-timeout must be above 0")
	}
	timeout = time.Duration(next.FeedbackTimeout.Ns)
	return nil
}

func Execute(scan Scan, inputs Inputs, commands Commands) (Outputs, Alarms) {
	if commands&CommandsReset != 0 {
		alarms = 0
	}
	before := run
	if commands&CommandsStop != 0 || !inputs.Interlock {
		run = false
	} else if commands&CommandsStart != 0 && !run && alarms == 0 {
		run = true
		retained.Starts++
	}
	elapsed := time.Duration(scan.Elapsed)
	if run != before || run == inputs.Feedback {
		waiting = 0
	} else {
		waiting += elapsed
	}
	if waiting >= timeout {
		if run {
			alarms |= AlarmsMissStarting
		} else {
			alarms |= AlarmsMissStopping
		}
		run, waiting = false, 0
	}
	running := run && inputs.Feedback
	if running {
		retained.Hours += elapsed.Hours()
	}
	return Outputs{Run: run, Running: running}, alarms
}

func Save() Retained { return retained }

func Restore(state Retained) { retained = state }
