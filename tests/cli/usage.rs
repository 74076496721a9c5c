//! Help, options and what is refused before any work.

use crate::program::Sandbox;

const COMMANDS: [&str; 8] = [
    "view", "bake", "render", "inspect", "compare", "export", "merge", "study",
];

#[test]
fn help_goes_to_stdout_and_names_what_there_is() {
    let sandbox = Sandbox::new();
    let help = sandbox.succeed("--help");
    assert_eq!(help.stderr, "");
    for command in COMMANDS {
        assert!(help.stdout.contains(command), "{command}");
        let own = sandbox.succeed(&format!("{command} --help"));
        assert!(own.stdout.contains("--json"), "{}", own.stdout);
    }
    let version = sandbox.succeed("--version");
    assert_eq!(
        version.stdout,
        format!("nephroid {}\n", env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn bad_usage_is_one_sentence_and_exit_2() {
    let sandbox = Sandbox::new();
    for (line, word) in [
        ("bake", "required"),
        ("bake builtin:ring", "--output"),
        ("bake builtin:ring -o out --density -5", "--density"),
        ("bake builtin:ring -o out --density nan", "--density"),
        ("bake builtin:ring -o out --density many", "--density"),
        ("bake builtin:ring -o out --sigma -1", "--sigma"),
        ("bake builtin:ring -o out --estimator splat --sigma 0", "--sigma"),
        ("bake builtin:ring -o out --sigma adaptive", "--sigma"),
        ("bake builtin:ring -o out --footprint disc", "--footprint"),
        ("bake builtin:ring -o out --rays jittered", "--rays"),
        ("bake builtin:ring -o out --max-error 0", "--max-error"),
        ("bake builtin:ring -o out --max-error many", "--max-error"),
        (
            "bake builtin:ring -o out --estimator splat --max-error 2%",
            "--max-error",
        ),
        ("bake builtin:ring -o out --map-resolution 0", "--map-resolution"),
        ("bake builtin:ring -o out --map-resolution -4", "--map-resolution"),
        (
            "bake builtin:ring -o out --map-resolution 64x0",
            "--map-resolution",
        ),
        (
            "bake builtin:ring -o out --map-resolution 99999",
            "--map-resolution",
        ),
        ("bake builtin:ring -o out --max-depth 0", "--max-depth"),
        (
            "bake builtin:ring -o out --branch-threshold 2",
            "--branch-threshold",
        ),
        ("bake builtin:ring -o out --threads 0", "--threads"),
        ("bake builtin:ring -o out --memory 0", "--memory"),
        ("bake builtin:ring -o out --layers ambient", "--layers"),
        ("bake builtin:ring -o out --kernel round", "--kernel"),
        (
            "bake builtin:ring -o out --estimator splat --kernel box --sigma 2",
            "--sigma",
        ),
        ("bake builtin:ring -o out --wavelengths 0", "--wavelengths"),
        ("bake builtin:ring -o out --shard 2", "--shard"),
        ("bake builtin:ring -o out --shard 1/2", "--density"),
        ("merge -o out", "required"),
        ("merge shard", "--output"),
        ("render builtin:ring -o picture", ".png"),
        ("render builtin:ring -o picture.gif", ".png"),
        ("render builtin:ring -o a.png --size 0x5", "--size"),
        ("render builtin:ring -o a.png --maps out --density 10", "--maps"),
        ("render builtin:ring -o a.exr --exposure 2", "--exposure"),
        ("render builtin:ring -o a.exr --tone-map none", "--tone-map"),
        ("compare a.exr", "REFERENCE"),
        ("compare a.exr b.exr --max-rmse -1", "--max-rmse"),
        ("compare a.exr b.exr --difference c.exr", "--difference"),
        ("view builtin:ring --json", "--json"),
        ("inspect builtin:ring --log loudly", "--log"),
    ] {
        let run = sandbox.run(line);
        assert_eq!(run.code, 2, "{line}: {}", run.stderr);
        run.failed_in_one_sentence(2, &[word]);
    }
    assert!(sandbox.files(".").is_empty(), "bad usage writes nothing");
}

#[test]
fn values_at_the_ends_of_their_ranges_are_taken() {
    let sandbox = Sandbox::new();
    for options in [
        "--density 1",
        "--density 1e12",
        "--estimator splat --sigma adaptive",
        "--sigma 0.25",
        "--sigma 0",
        "--max-error 5%",
        "--max-error 0.02 --density 2000",
        "--map-resolution auto",
        "--map-resolution 16384x1",
        "--max-depth 1",
        "--branch-threshold 0",
        "--memory 1M",
        "--layers caustic,direct",
        "--estimator splat --rays jittered --seed 18446744073709551615",
        "--estimator splat --kernel cone --kernel-sampling point --footprint fixed --item-buffer cube",
        "--estimator splat --preset final",
    ] {
        sandbox.succeed(&format!("inspect builtin:mirror {options}"));
    }
}
