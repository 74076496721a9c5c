//! The program as a user runs it: options, streams, exit codes, files.

#[path = "cli/bake.rs"]
mod bake;
#[path = "cli/cache.rs"]
mod cache;
#[path = "cli/compare.rs"]
mod compare;
#[path = "cli/errors.rs"]
mod errors;
#[path = "cli/export.rs"]
mod export;
#[path = "cli/export_ktx2.rs"]
mod export_ktx2;
#[path = "cli/export_textures.rs"]
mod export_textures;
#[cfg(unix)]
#[path = "cli/faults.rs"]
mod faults;
#[path = "cli/folders.rs"]
mod folders;
#[path = "scene/glb.rs"]
#[allow(dead_code)]
mod glb;
#[path = "cli/headless.rs"]
mod headless;
#[path = "cli/inspect.rs"]
mod inspect;
#[path = "cli/program.rs"]
mod program;
#[path = "cli/render.rs"]
mod render;
#[path = "cli/render_path.rs"]
mod render_path;
#[path = "cli/scenes.rs"]
mod scenes;
#[path = "cli/shards.rs"]
mod shards;
#[cfg(unix)]
#[path = "cli/signals.rs"]
mod signals;
#[cfg(feature = "gpu")]
#[path = "support/skip.rs"]
mod skip;
#[path = "cli/study.rs"]
mod study;
#[path = "cli/study_pages.rs"]
mod study_pages;
#[path = "cli/usage.rs"]
mod usage;
