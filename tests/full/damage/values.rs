//! Values of options: every option of `inspect`, with everything that could be typed after it.

use super::mutate::{Damage, effort};
use support::program::{Run, Sandbox};

const OPTIONS: &str = "--preset --estimator --density --max-error --max-time --rays --sigma --kernel \
    --kernel-sampling --footprint --item-buffer --map-resolution --max-depth --branch-threshold --layers --effects --seed \
    --memory --threads --environment --log --solid-glass --per-light";

const VALUES: &str = "| |0|-0|-1|1|2|3.5|64|1e3|1e-320|1e308|1e309|-1e309|nan|NaN|inf|-inf|infinity|18446744073709551616|\
    99999999999999999999999999|0x10|1_000|1,5|1,,2|,|auto|adaptive|on|refraction=on|refraction=|=|64x64|0x0|\
    16384x16384|%|200%|5sx|\u{661}\u{662}|\u{1f4a1}";

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

#[test]
fn values_are_taken_or_refused_in_one_sentence() {
    let sandbox = Sandbox::new();
    let [options, values] =
        [(OPTIONS, ' '), (VALUES, '|')].map(|(all, by)| all.split(by).collect::<Vec<_>>());
    let (mut taken, mut refused) = (0, 0);
    for number in 0..60 * effort() {
        let mut damage = Damage::to("values", number);
        let mut arguments = vec!["inspect", "builtin:mirror", "--no-cache"];
        for _ in 0..1 + damage.below(4) / 3 {
            arguments.extend([*damage.one_of(&options), *damage.one_of(&values)]);
        }
        let output = sandbox.command(&arguments).output().expect("the program starts");
        assert!(
            output.status.code().is_some(),
            "{arguments:?} was killed: {:?}",
            output.status
        );
        let run = Run::from(output);
        assert_eq!(ending_fault(&run), None, "{arguments:?}");
        if run.code == 0 { taken += 1 } else { refused += 1 }
    }
    assert!(taken >= 1 && refused >= 20, "{taken} taken, {refused} refused");
}
