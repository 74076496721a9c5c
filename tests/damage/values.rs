//! Values of options: every option of `inspect` and of `compare`, with everything that could be typed after it.

use std::time::{Duration, Instant};

use crate::mutate::{Damage, effort};
use crate::program::{Run, Sandbox};

/// A test for endless loops, not for speed.
const PATIENCE: Duration = Duration::from_secs(300);

const OPTIONS: [&str; 24] = [
    "--preset",
    "--estimator",
    "--density",
    "--max-error",
    "--max-time",
    "--wavefronts",
    "--rays",
    "--sigma",
    "--kernel",
    "--kernel-sampling",
    "--footprint",
    "--item-buffer",
    "--map-resolution",
    "--max-depth",
    "--branch-threshold",
    "--layers",
    "--effects",
    "--seed",
    "--memory",
    "--threads",
    "--environment",
    "--log",
    "--solid-glass",
    "--per-light",
];

const VALUES: [&str; 40] = [
    "",
    " ",
    "0",
    "-0",
    "-1",
    "1",
    "2",
    "3.5",
    "64",
    "1e3",
    "1e-320",
    "1e308",
    "1e309",
    "-1e309",
    "nan",
    "NaN",
    "inf",
    "-inf",
    "infinity",
    "18446744073709551616",
    "99999999999999999999999999",
    "0x10",
    "1_000",
    "1,5",
    "1,,2",
    ",",
    "auto",
    "adaptive",
    "on",
    "refraction=on",
    "refraction=",
    "=",
    "64x64",
    "0x0",
    "16384x16384",
    "%",
    "200%",
    "5sx",
    "\u{661}\u{662}",
    "\u{1f4a1}",
];

/// What is wrong with how a run ended, if anything is: it succeeds, or fails with one line on stderr that says what.
fn ending_fault(run: &Run) -> Option<String> {
    let errors: Vec<&str> = run
        .stderr
        .lines()
        .filter(|line| line.starts_with("error: "))
        .collect();
    let is_fair = match run.code {
        0 => errors.is_empty() && !run.stdout.is_empty(),
        1 | 2 => matches!(errors[..], [sentence] if sentence.contains("; ")) && run.stdout.is_empty(),
        _ => false,
    };
    (!is_fair).then(|| format!("exit {}, {:?}", run.code, run.stderr))
}

fn run(sandbox: &Sandbox, arguments: &[&str]) -> Run {
    let start = Instant::now();
    let output = sandbox.command(arguments).output().expect("the program starts");
    assert!(
        start.elapsed() < PATIENCE,
        "{arguments:?} took {:?}",
        start.elapsed()
    );
    assert!(
        output.status.code().is_some(),
        "{arguments:?} was killed: {:?}",
        output.status
    );
    Run::from(output)
}

#[test]
fn values_are_taken_or_refused_in_one_sentence() {
    let _alone = crate::watch::alone();
    let sandbox = Sandbox::new();
    let (mut taken, mut refused) = (0, 0);
    for number in 0..60 * effort() {
        let mut damage = Damage::to("values", number);
        let mut arguments = vec!["inspect", "builtin:mirror", "--no-cache"];
        for _ in 0..1 + damage.below(4) / 3 {
            arguments.push(*damage.one_of::<&str>(&OPTIONS));
            arguments.push(*damage.one_of::<&str>(&VALUES));
        }
        let run = run(&sandbox, &arguments);
        assert_eq!(ending_fault(&run), None, "{arguments:?}");
        if run.code == 0 { taken += 1 } else { refused += 1 }
    }
    println!("values of options: {taken} taken, {refused} refused");
    assert!(taken >= 1 && refused >= 20, "{taken} taken, {refused} refused");
}

#[test]
fn a_panic_or_two_sentences_do_not_pass() {
    let _alone = crate::watch::alone();
    let run = |code, stdout: &str, stderr: &str| Run {
        code,
        stdout: stdout.into(),
        stderr: stderr.into(),
    };
    for fair in [
        run(0, "a result", "warning: a: b; c"),
        run(2, "", "error: --density: it is too large; give less"),
    ] {
        assert_eq!(ending_fault(&fair), None);
    }
    for unfair in [
        run(101, "", "thread 'main' panicked"),
        run(2, "", "error: a; b\nerror: c; d"),
        run(1, "", "something went wrong"),
        run(1, "a result", "error: a; b"),
        run(0, "", ""),
        run(0, "a result", "error: a; b"),
    ] {
        assert!(
            ending_fault(&unfair).is_some(),
            "{} {:?} passes",
            unfair.code,
            unfair.stderr
        );
    }
}
