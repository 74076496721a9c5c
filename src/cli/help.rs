//! `--help`: examples first, then one line for each option. `-h` leaves out rare ones.

use std::ffi::OsString;

use clap::CommandFactory;

use super::Arguments;
use super::bake_options::{COMMON, HEADING};

const TEMPLATE: &str = "{about-with-newline}\n{before-help}{usage-heading} {usage}\n\n{all-args}{after-help}";

/// Options that the help of `bake` only mentions, so that it fits a screen.
const ONLY_NAMED: [&str; 8] = [
    "scene",
    "rays",
    "kernel",
    "kernel-sampling",
    "footprint",
    "item-buffer",
    "spectral-sampling",
    "keep-spectrum",
];

const BAKE_NOTE: &str = "Of the paper: --rays, --kernel, --kernel-sampling, --footprint, --item-buffer.
By wavelength: --spectral-sampling, --keep-spectrum.
Values, accuracy and cost of every option: src/guide/options.md, also in `cargo doc`.";

const OTHER_NOTE: &str = "`nephroid bake --help` lists all bake options.";

/// Examples of each command.
const EXAMPLES: [(&str, &str); 15] = [
    (
        "nephroid",
        "nephroid                                  the built-in gallery in a window
nephroid scene.glb                        your scene in a window
nephroid bake scene.glb -o maps           maps at 3 % visible error
nephroid render scene.glb -o picture.png  a picture",
    ),
    (
        "view",
        "nephroid view scene.glb --watch           read the scene again whenever its files change
nephroid view scene.glb --maps maps       maps that were baked before",
    ),
    (
        "bake",
        "nephroid bake scene.glb -o maps                           maps at 3 % visible error
nephroid bake scene.glb -o maps --max-error 1% --layers caustic,direct,indirect
nephroid bake builtin:ring -o ring --density 1e5          exactly that many rays",
    ),
    (
        "render",
        "nephroid render scene.glb -o picture.png --preset draft
nephroid render scene.glb -o picture.exr --maps maps --camera 1
nephroid render scene.glb -o frames --turntable 120",
    ),
    (
        "inspect",
        "nephroid inspect scene.glb
nephroid inspect builtin:gallery --json",
    ),
    (
        "compare",
        "nephroid compare ring/maps/0000_floor.exr assets/reference/S1.pfm --difference difference.png",
    ),
    (
        "export",
        "nephroid export maps -o lit.glb                 the scene with light maps
nephroid export maps -o lit.glb --as emissive   light as emission: any viewer shows it
nephroid export maps --format ktx2 -o textures  textures with index.json",
    ),
    (
        "merge",
        "nephroid bake scene.glb --density 1e6 --map-resolution 1024 --shard 1/2 -o shards/1
nephroid bake scene.glb --density 1e6 --map-resolution 1024 --shard 2/2 -o shards/2
nephroid merge shards/1 shards/2 -o maps",
    ),
    (
        "study",
        "nephroid study convergence builtin:ring -o study --quick
nephroid study accuracy -o study",
    ),
    (
        "convergence",
        "nephroid study convergence builtin:ring -o study --densities 3e2,3e3,3e4,3e5",
    ),
    (
        "reference",
        "nephroid study reference scene.glb -o reference --rays 1e8",
    ),
    (
        "effects",
        "nephroid study effects builtin:ball -o study --density 1e5",
    ),
    (
        "spectrum",
        "nephroid study spectrum -o study --wavelengths 1,4,7,13",
    ),
    ("accuracy", "nephroid study accuracy -o study"),
    ("pages", "nephroid study pages -o pages --quick"),
];

/// The help that a command line asks for.
pub fn text(words: impl Iterator<Item = OsString>) -> String {
    // Building adds `--help` to every subcommand, so that its text can be set below.
    let mut command = <Arguments as CommandFactory>::command();
    command.build();

    // Descend to the subcommand that the words name.
    let mut is_long = false;
    for word in words {
        is_long |= word == "--help" || word == "help";
        if word != "help"
            && let Some(inner) = command.find_subcommand(&word)
        {
            command = inner.clone();
        }
    }
    let name = command.get_name().to_string();
    let is_root = name == "nephroid";

    // Examples come first, notes about bake options last.
    let has_bake_options = command
        .get_arguments()
        .any(|arg| arg.get_help_heading() == Some(HEADING));
    let note = match has_bake_options && !is_root {
        true if name == "bake" => BAKE_NOTE,
        true => OTHER_NOTE,
        false => "",
    };
    let examples = EXAMPLES.iter().find(|(of, _)| *of == name);
    let examples = examples.map_or(String::new(), |(_, lines)| {
        format!("Examples:\n  {}", lines.replace('\n', "\n  "))
    });

    command = command
        .help_template(TEMPLATE)
        .before_help(examples)
        .after_help(note)
        .mut_args(|arg| {
            // Hide the bake options that the command does not list, and rare options in short help.
            let id = arg.get_id().as_str();
            let is_of_bake = arg.get_help_heading() == Some(HEADING);
            let is_left_out = match name.as_str() {
                "nephroid" => !["help", "version"].contains(&id),
                "bake" => ONLY_NAMED.contains(&id),
                _ => is_of_bake && !COMMON.contains(&id),
            };
            let arg = match id == "help" && is_long {
                true => arg.help("Print help"),
                false => arg,
            };
            let is_hidden = arg.is_hide_set() || is_left_out;
            let is_rare = arg.is_hide_short_help_set() && !is_long;
            arg.hide_possible_values(true)
                .hide(is_hidden)
                .hide_short_help(is_rare)
        });

    // The root hides the options of `view`; its usage says whose they are.
    if is_root {
        command = command.override_usage("nephroid [SCENE] [OPTIONS of view]\n       nephroid <COMMAND>");
    }
    command.render_help().to_string()
}
