//! cyclictest: what the kernel of this machine gives a thread of the same priority on the same CPU.

use std::process::Command;

/// Runs it beside whatever load there is: its samples in ns, and the longest, which may lie beyond them. `None` with a line on
/// stderr where it cannot be had.
pub(crate) fn run(cpu: usize, priority: u8, interval_us: u64, events: usize) -> Option<(Vec<u64>, u64)> {
    let mut command = Command::new("cyclictest");
    command.args(["--quiet", "--mlockall", "--threads=1", "--histogram=5000"]);
    command.arg(format!("--affinity={cpu}")).arg(format!("--priority={priority}"));
    command.arg(format!("--interval={interval_us}")).arg(format!("--loops={events}"));
    let output = match command.output() {
        Ok(output) if output.status.success() => output,
        Ok(output) => {
            eprintln!("cyclictest failed: {}", String::from_utf8_lossy(&output.stderr).trim());
            return None;
        }
        Err(error) => {
            eprintln!("cyclictest cannot be run ({error}); `apt install rt-tests` brings it");
            return None;
        }
    };
    let text = String::from_utf8_lossy(&output.stdout);
    let mut samples = Vec::with_capacity(events);
    let mut max = 0;
    for line in text.lines() {
        if let Some(of) = line.strip_prefix("# Max Latencies:") {
            max = of.trim().parse().unwrap_or(0);
        }
        let mut words = line.split_whitespace();
        if let (Some(Ok(us)), Some(Ok(count))) =
            (words.next().map(str::parse::<u64>), words.next().map(str::parse::<usize>))
        {
            samples.extend(std::iter::repeat_n(us * 1000, count));
        }
    }
    Some((samples, max * 1000))
}
