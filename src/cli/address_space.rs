//! The address space that the system grants the process. Memory that does not fit into it ends a program on the spot:
//! it has to be known before.

use std::borrow::Cow;
use std::path::Path;

use nephroid::error::Warning;
use nephroid::files;
use nephroid::settings::BakeSettings;

use super::survey_report::bytes;
use super::terminal::Terminal;

/// More than the system says about a process [bytes].
const MOST_BYTES: u64 = 1 << 16;

/// Share of what is left that maps may take: as much again for rays, files and the system's own tables.
const SHARE_OF_MAPS: u64 = 2;

/// The settings with no more memory for maps than there is room for, with a warning where that is less than they ask.
pub fn within_reach<'a>(settings: &'a BakeSettings, terminal: &Terminal) -> Cow<'a, BakeSettings> {
    let most = left_bytes().map_or(u64::MAX, |left| left / SHARE_OF_MAPS);
    if settings.memory_bytes <= most {
        return Cow::Borrowed(settings);
    }
    terminal.print_warnings(&[Warning::new(
        "--memory",
        format!(
            "the system grants this process so little address space that maps may take {} and not {}",
            bytes(most),
            bytes(settings.memory_bytes)
        ),
        "raise the limit (ulimit -v) for finer maps",
    )]);
    Cow::Owned(BakeSettings {
        memory_bytes: most,
        ..settings.clone()
    })
}

/// Address space that is granted and not taken yet [bytes]; `None` where it is not limited or the system does not tell.
fn left_bytes() -> Option<u64> {
    let read = |name: &str| {
        let bytes = files::read_file(&Path::new("/proc/self").join(name), MOST_BYTES).ok()?;
        String::from_utf8(bytes).ok()
    };
    let limit = granted_bytes(&read("limits")?)?;
    Some(limit.saturating_sub(taken_bytes(&read("status")?)?))
}

/// The limit in the text of `/proc/PID/limits`; `None` where there is none.
fn granted_bytes(limits: &str) -> Option<u64> {
    let line = limits
        .lines()
        .find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// What is taken by the text of `/proc/PID/status`, in which it stands in KiB.
fn taken_bytes(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmSize:"))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read_as_the_system_writes_them() {
        let limits = |value: &str| {
            format!(
                "Limit                     Soft Limit           Hard Limit           Units     \n\
                 Max open files            1024                 524288               files     \n\
                 Max address space         {value}           unlimited            bytes     \n"
            )
        };
        assert_eq!(granted_bytes(&limits("1536000000")), Some(1_536_000_000));
        assert_eq!(granted_bytes(&limits("unlimited")), None);
        assert_eq!(granted_bytes(""), None);
        assert_eq!(
            taken_bytes("Name:\tnephroid\nVmPeak:\t  300 kB\nVmSize:\t  200 kB\n"),
            Some(204_800)
        );
        assert_eq!(taken_bytes("Name:\tnephroid\n"), None);
    }
}
