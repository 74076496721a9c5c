//! Studies are listed, run and write what they say.

use support::program::Sandbox;

#[test]
fn study_lists_and_runs() {
    let sandbox = Sandbox::new();
    let list = sandbox.succeed("study --list --json").json();
    let list = list.as_array().expect("studies");
    for name in [
        "convergence",
        "reference",
        "effects",
        "spectrum",
        "accuracy",
        "table1",
    ] {
        assert!(list.iter().any(|study| study["name"] == name), "{name}");
    }
    let run = sandbox.succeed(
        "study convergence builtin:mirror -o out --densities 1e2,1e3 --estimators splat --quick --map-resolution 16",
    );
    let files = "convergence-cpu.svg convergence-rays.svg convergence.csv convergence.md";
    assert_eq!(sandbox.files("out").join(" "), files);
    let csv = std::fs::read_to_string(sandbox.path("out/convergence.csv")).expect("a table");
    assert_eq!(csv.lines().count(), 3);
    assert!(csv.starts_with("estimator,density_per_sr,rays,"), "{csv}");
    assert!(run.stdout.contains("| splat |"), "{}", run.stdout);
}
