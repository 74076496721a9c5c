//! What a pass over the lattice of a light gives before anything is made of it: whole numbers, which add up exactly over
//! the shards of the pass whatever their order.

use std::io::{self, BufRead, BufReader, Read};

use super::coding::{Reader, Writer, damaged};
use crate::illumination::Receiver;
use crate::illumination::accumulator::{FluxAccumulator, FluxCount};
use crate::light_pass::caustic::pass::{PassReport, Seconds};
use crate::light_pass::receiver_maps::{ChartFor, ReceiverMaps};
use crate::light_pass::wavefront::kept_rays::{Help, RayKey};
use crate::light_pass::wavefront::ray_log::{LoggedBand, LoggedRay, RayLog};
use crate::session::part_maps::PartMaps;
use crate::transport::PathCounts;

/// No texel counts more: units are chosen so that all flux of a light stays below 2⁶⁰.
const MOST_OF_A_TEXEL: i64 = 1 << 61;

/// No account counts more, over all wavefronts and shards.
const MOST_OF_AN_ACCOUNT: i128 = 1 << 100;

/// Nothing is counted more often than this.
const MOST_OF_A_COUNT: u64 = 1 << 56;

/// Effort of the compression: more is much slower and hardly smaller.
const COMPRESSION: i32 = 1;

/// Sums of a pass.
#[derive(Debug)]
pub(in crate::session) struct PassSums {
    /// One, or those of two half sets.
    pub(in crate::session) maps: Vec<PartMaps>,
    /// Accounts, counts and times.
    pub(in crate::session) report: PassReport,
    /// Rays that were searched, where a bake of the whole would know some of them from before.
    pub(in crate::session) rays: RayLog,
    /// What arrivals would take if they were kept [bytes].
    pub(in crate::session) kept_bytes: u64,
}

impl PassSums {
    /// Nothing yet.
    pub(in crate::session) fn new(maps: Vec<PartMaps>) -> Self {
        Self {
            maps,
            report: PassReport::default(),
            rays: RayLog::default(),
            kept_bytes: 0,
        }
    }

    /// As a shard's file holds them.
    pub(super) fn encode(&self) -> io::Result<Vec<u8>> {
        let mut writer = Writer::default();
        write_report(&mut writer, &self.report);
        writer.whole(u128::from(self.kept_bytes));
        for set in self.maps.iter().flat_map(PartMaps::sets) {
            write_maps(&mut writer, set);
        }
        write_rays(&mut writer, &self.rays);
        let mut encoder = zstd::stream::Encoder::new(Vec::new(), COMPRESSION)?;
        encoder.include_checksum(true)?;
        io::Write::write_all(&mut encoder, &writer.into_bytes())?;
        encoder.finish()
    }

    /// Adds what a shard's file holds. Sizes of maps are those of the charts here and nothing that the file says; rays
    /// take no more than so many bytes.
    pub(super) fn add_encoded(
        &mut self,
        bytes: &[u8],
        chart_for: &ChartFor,
        most_bytes: u64,
    ) -> io::Result<()> {
        let mut reader = Reader(BufReader::new(zstd::stream::Decoder::new(bytes)?.single_frame()));
        read_report(&mut reader, &mut self.report)?;
        let kept_bytes = reader.whole()?;
        self.kept_bytes = checked(self.kept_bytes.checked_add(kept_bytes))?;
        for set in self.maps.iter_mut().flat_map(PartMaps::sets_mut) {
            read_maps(&mut reader, set, chart_for)?;
        }
        let left = most_bytes.saturating_sub(self.rays.bytes());
        if !self.rays.merge(read_rays(&mut reader, left)?) {
            return Err(damaged("it counts other bands than the shards before it"));
        }
        reader.end()
    }
}

fn checked<T>(sum: Option<T>) -> io::Result<T> {
    sum.ok_or_else(|| damaged("a sum is too large"))
}

/// Counts of a report, in the order in which they are written.
fn counts_of(report: &mut PassReport) -> Vec<&mut u64> {
    fn of_paths(counts: &mut PathCounts) -> [&mut u64; 7] {
        let PathCounts {
            transmitted,
            reflected,
            attenuated,
            textured,
            bent,
            scattered,
            of_a_wavelength,
        } = counts;
        [
            transmitted,
            reflected,
            attenuated,
            textured,
            bent,
            scattered,
            of_a_wavelength,
        ]
    }
    let mut counts = vec![
        &mut report.rays,
        &mut report.segments,
        &mut report.splats,
        &mut report.cells,
        &mut report.receiver_queries,
    ];
    counts.extend(of_paths(&mut report.paths));
    counts.extend(of_paths(&mut report.deposits));
    counts
}

fn write_report(writer: &mut Writer, report: &PassReport) {
    for count in counts_of(&mut report.clone()) {
        writer.whole(u128::from(*count));
    }
    report.ledger.counts().for_each(|count| writer.signed(count));
    for seconds in [report.trace_s, report.deposit_s] {
        writer.real(seconds.wall);
        writer.real(seconds.cpu);
    }
}

/// CPU time adds up; shards run side by side, so that the slowest one's time on the wall counts.
fn read_report(reader: &mut Reader<impl Read>, report: &mut PassReport) -> io::Result<()> {
    for count in counts_of(report) {
        *count = checked(count.checked_add(reader.whole()?))?;
        if *count > MOST_OF_A_COUNT {
            return Err(damaged("a count is too large"));
        }
    }
    for count in report.ledger.counts_mut() {
        *count = checked(count.checked_add(reader.signed()?))?;
        if count.unsigned_abs() > MOST_OF_AN_ACCOUNT.unsigned_abs() {
            return Err(damaged("an account is too large"));
        }
    }
    for sum in [&mut report.trace_s, &mut report.deposit_s] {
        let (wall, cpu) = (reader.real()?, reader.real()?);
        *sum = Seconds {
            wall: sum.wall.max(wall),
            cpu: sum.cpu + cpu,
        };
    }
    Ok(())
}

fn write_maps(writer: &mut Writer, maps: &ReceiverMaps) {
    writer.whole(maps.iter().count() as u128);
    for (receiver, map) in maps.iter() {
        writer.whole(receiver.index() as u128);
        writer.whole(map.levels().len() as u128);
        for level in map.levels() {
            writer.whole(level.width() as u128);
            writer.whole(level.height() as u128);
            write_texels(writer, level.texels());
        }
    }
}

/// Channel by channel, green and blue as what they differ from red by: of grey light that is nothing.
fn write_texels(writer: &mut Writer, texels: &[FluxCount]) {
    for channel in 0..3 {
        for texel in texels {
            let base = if channel > 0 { texel[0] } else { 0 };
            writer.word(texel[channel].wrapping_sub(base) as u64);
        }
    }
}

fn read_maps(
    reader: &mut Reader<impl Read>,
    maps: &mut ReceiverMaps,
    chart_for: &ChartFor,
) -> io::Result<()> {
    let receivers: Vec<Receiver> = maps.receivers().collect();
    let mut next = 0;
    for _ in 0..reader.whole()? {
        let index = reader.whole()?;
        let of_index = usize::try_from(index).ok().filter(|index| *index >= next);
        let (Some(index), Some(&receiver)) = (of_index, of_index.and_then(|index| receivers.get(index)))
        else {
            return Err(damaged("it names a surface that the scene has not"));
        };
        next = index + 1;
        maps.touch(receiver, chart_for);
        let Some(map) = maps.get_mut(receiver) else {
            return Err(damaged("it has a map of a surface that takes none"));
        };
        let levels = map.levels_mut();
        if reader.whole()? != levels.len() as u64 {
            return Err(damaged("a map has another size than it should"));
        }
        for level in levels {
            let size = (reader.whole()?, reader.whole()?);
            if size != (level.width() as u64, level.height() as u64) {
                return Err(damaged("a map has another size than it should"));
            }
            add_texels(reader, level)?;
        }
    }
    Ok(())
}

fn add_texels(reader: &mut Reader<impl Read>, level: &mut FluxAccumulator) -> io::Result<()> {
    let mut red = vec![0_i64; level.texels().len()];
    for channel in 0..3 {
        for (texel, red) in level.texels_mut().iter_mut().zip(&mut red) {
            let value = red.wrapping_add(reader.word()? as i64);
            if channel == 0 {
                *red = value;
            }
            let sum = checked(texel[channel].checked_add(value))?;
            if sum.unsigned_abs() > MOST_OF_A_TEXEL.unsigned_abs() {
                return Err(damaged("a texel holds more light than the lamp sends"));
            }
            texel[channel] = sum;
        }
    }
    Ok(())
}

fn write_rays(writer: &mut Writer, log: &RayLog) {
    writer.whole(u128::from(log.band_count));
    writer.whole(log.bands.len() as u128);
    for band in &log.bands {
        writer.whole(u128::from(band.number));
        writer.whole(band.rays.len() as u128);
        for ray in &band.rays {
            let (face, node, square) = ray.key.parts();
            writer.whole(u128::from(face));
            writer.whole(u128::from(node));
            square.into_iter().for_each(|bits| writer.word(bits));
            writer.whole(u128::from(ray.segments));
            writer.whole(u128::from(ray.transmitted));
            writer.whole(u128::from(ray.help.is_some()));
            if let Some(help) = ray.help {
                for count in [help.node, help.searched, help.transmitted, help.reflected] {
                    writer.whole(u128::from(count));
                }
            }
        }
    }
}

/// No list is longer than the file is: all grow with what is read.
fn read_rays(reader: &mut Reader<impl BufRead>, most_bytes: u64) -> io::Result<RayLog> {
    let mut log = RayLog {
        band_count: reader.whole()?,
        bands: Vec::new(),
    };
    let mut bytes = 0;
    let mut take = |size: usize| {
        bytes += size as u64;
        if bytes > most_bytes {
            return Err(io::Error::from(io::ErrorKind::OutOfMemory));
        }
        Ok(())
    };
    for _ in 0..reader.whole()? {
        take(size_of::<LoggedBand>())?;
        let mut band = LoggedBand {
            number: reader.whole()?,
            rays: Vec::new(),
        };
        for _ in 0..reader.whole()? {
            take(size_of::<LoggedRay>())?;
            band.rays.push(read_ray(reader)?);
        }
        log.bands.push(band);
    }
    Ok(log)
}

fn read_ray(reader: &mut Reader<impl Read>) -> io::Result<LoggedRay> {
    let (face, node) = (reader.small()?, reader.small()?);
    let square = [reader.word()?, reader.word()?];
    let (segments, transmitted) = (reader.small()?, reader.small()?);
    let help = match reader.small()? {
        0 => None,
        1 => Some(Help {
            node: reader.small()?,
            searched: reader.small()?,
            transmitted: reader.small()?,
            reflected: reader.small()?,
        }),
        _ => return Err(damaged("a ray is none")),
    };
    Ok(LoggedRay {
        key: RayKey::from_parts((face, node, square)),
        segments,
        transmitted,
        help,
    })
}
