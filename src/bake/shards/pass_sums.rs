//! Raw sums of one pass over the lattice of a light. They are integers, so the shards of a pass add up exactly in any
//! order.

use std::io::{self, BufReader, Read};

use crate::bake::band_maps::BandMaps;
use crate::illumination::Receiver;
use crate::illumination::accumulator::FluxAccumulator;
use crate::light_pass::pass_report::{PassReport, Seconds};
use crate::light_pass::receiver_maps::{ChartFor, ReceiverMaps};
use crate::light_pass::shard_index::ShardIndex;

/// Upper limit of a texel's count; units are chosen so that all flux of a light stays below 2⁶⁰.
const MAX_TEXEL_SUM: i64 = 1 << 61;

/// Upper limit of an account, over all wavefronts and shards.
const MAX_ACCOUNT_SUM: i128 = 1 << 100;

/// Upper limit of a counter.
const MAX_COUNT: u64 = 1 << 56;

/// Upper limit of a time [s].
const MAX_SECONDS: f64 = 1e12;

/// Compression level; higher ones are much slower and save hardly anything.
const COMPRESSION: i32 = 1;

#[derive(Debug)]
pub(in crate::bake) struct PassSums {
    /// Maps of the pass, or of its two half sets.
    pub(in crate::bake) maps: Vec<BandMaps>,
    /// Accounts, counts and times.
    pub(in crate::bake) report: PassReport,
}

impl PassSums {
    pub(in crate::bake) fn new(maps: Vec<BandMaps>) -> Self {
        Self {
            maps,
            report: PassReport::default(),
        }
    }

    /// Encodes the sums and the number of the pass for a shard's file: little-endian, compressed.
    pub(super) fn encode(&self, share: ShardIndex, number: usize) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        write_whole(&mut bytes, [number as u64]);
        write_whole(&mut bytes, [share.number(), share.count()].map(u64::from));
        write_report(&mut bytes, &self.report);
        for set in self.maps.iter().flat_map(BandMaps::sets) {
            write_maps(&mut bytes, set);
        }
        let mut encoder = zstd::stream::Encoder::new(Vec::new(), COMPRESSION)?;
        encoder.include_checksum(true)?;
        io::Write::write_all(&mut encoder, &bytes)?;
        encoder.finish()
    }

    /// Adds the sums in a shard's file; returns the shard's number and the number of shards. Sizes of maps are those of
    /// the charts, never those in the file.
    pub(super) fn add_encoded(
        &mut self,
        number: usize,
        bytes: &[u8],
        chart_for: &ChartFor,
    ) -> io::Result<(u32, u32)> {
        let mut reader = BufReader::new(zstd::stream::Decoder::new(bytes)?.single_frame());
        if whole(&mut reader)? != number as u64 {
            return Err(damaged("it is another pass"));
        }
        let small = |value: u64| u32::try_from(value).map_err(|_| damaged("there are not so many shards"));
        let share = (small(whole(&mut reader)?)?, small(whole(&mut reader)?)?);
        read_report(&mut reader, &mut self.report)?;
        for set in self.maps.iter_mut().flat_map(BandMaps::sets_mut) {
            read_maps(&mut reader, set, chart_for)?;
        }
        match reader.read(&mut [0])? {
            0 => Ok(share),
            _ => Err(damaged("there is more than it should hold")),
        }
    }
}

/// The error for data that no shard writes.
fn damaged(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

fn checked<T>(sum: Option<T>) -> io::Result<T> {
    sum.ok_or_else(|| damaged("a sum is too large"))
}

fn write_whole(bytes: &mut Vec<u8>, values: impl IntoIterator<Item = u64>) {
    values
        .into_iter()
        .for_each(|value| bytes.extend(value.to_le_bytes()));
}

fn read<const N: usize>(reader: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    reader.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn whole(reader: &mut impl Read) -> io::Result<u64> {
    read(reader).map(u64::from_le_bytes)
}

fn seconds(reader: &mut impl Read) -> io::Result<f64> {
    let value = f64::from_le_bytes(read(reader)?);
    let is_time = (0.0..=MAX_SECONDS).contains(&value);
    is_time.then_some(value).ok_or_else(|| damaged("a time is none"))
}

/// Counters of a report, in the order of the file.
fn counts_of(report: &mut PassReport) -> [&mut u64; 3] {
    [&mut report.rays, &mut report.segments, &mut report.splats]
}

fn write_report(bytes: &mut Vec<u8>, report: &PassReport) {
    write_whole(bytes, counts_of(&mut report.clone()).map(|count| *count));
    for count in report.ledger.counts() {
        bytes.extend(count.to_le_bytes());
    }
    for seconds in [report.trace_s, report.deposit_s] {
        write_whole(bytes, [seconds.wall, seconds.cpu].map(f64::to_bits));
    }
}

/// CPU times add up. Wall-clock times are maxima, because shards run side by side.
fn read_report(reader: &mut impl Read, report: &mut PassReport) -> io::Result<()> {
    for count in counts_of(report) {
        *count = checked(count.checked_add(whole(reader)?))?;
        if *count > MAX_COUNT {
            return Err(damaged("a count is too large"));
        }
    }
    for count in report.ledger.counts_mut() {
        *count = checked(count.checked_add(i128::from_le_bytes(read(reader)?)))?;
        if count.unsigned_abs() > MAX_ACCOUNT_SUM.unsigned_abs() {
            return Err(damaged("an account is too large"));
        }
    }
    for sum in [&mut report.trace_s, &mut report.deposit_s] {
        let (wall, cpu) = (seconds(reader)?, seconds(reader)?);
        *sum = Seconds {
            wall: sum.wall.max(wall),
            cpu: sum.cpu + cpu,
        };
    }
    Ok(())
}

fn write_maps(bytes: &mut Vec<u8>, maps: &ReceiverMaps) {
    write_whole(bytes, [maps.iter().count() as u64]);
    for (receiver, map) in maps.iter() {
        write_whole(bytes, [receiver.index() as u64, map.levels().len() as u64]);
        for level in map.levels() {
            write_whole(bytes, [level.width() as u64, level.height() as u64]);
            // Channel by channel; green and blue as differences from red, which are 0 for grey light.
            for channel in 0..3 {
                let base = |texel: &[i64; 3]| if channel > 0 { texel[0] } else { 0 };
                let differences = level
                    .texels()
                    .iter()
                    .map(|texel| texel[channel].wrapping_sub(base(texel)));
                write_whole(bytes, differences.map(|value| value as u64));
            }
        }
    }
}

fn read_maps(reader: &mut impl Read, maps: &mut ReceiverMaps, chart_for: &ChartFor) -> io::Result<()> {
    let receivers: Vec<Receiver> = maps.receivers().collect();
    let mut next = 0;
    for _ in 0..whole(reader)? {
        let index = usize::try_from(whole(reader)?).unwrap_or(usize::MAX);
        let Some(&receiver) = receivers.get(index).filter(|_| index >= next) else {
            return Err(damaged("it names a surface that the scene has not"));
        };
        next = index + 1;
        maps.touch(receiver, chart_for);
        let Some(map) = maps.get_mut(receiver) else {
            return Err(damaged("it has a map of a surface that takes none"));
        };
        let levels = usize::try_from(whole(reader)?).unwrap_or(usize::MAX);
        if !(1..=map.most_levels()).contains(&levels) {
            return Err(damaged("a map has another size than it should"));
        }
        for level in 0..levels {
            let (flux, _) = map.level(level);
            let size = (whole(reader)?, whole(reader)?);
            if size != (flux.width() as u64, flux.height() as u64) {
                return Err(damaged("a map has another size than it should"));
            }
            add_texels(reader, flux)?;
        }
    }
    Ok(())
}

fn add_texels(reader: &mut impl Read, level: &mut FluxAccumulator) -> io::Result<()> {
    let mut red = vec![0_i64; level.texels().len()];
    for channel in 0..3 {
        for (texel, red) in level.texels_mut().iter_mut().zip(&mut red) {
            let value = red.wrapping_add(whole(reader)? as i64);
            if channel == 0 {
                *red = value;
            }
            let sum = checked(texel[channel].checked_add(value))?;
            if sum.unsigned_abs() > MAX_TEXEL_SUM.unsigned_abs() {
                return Err(damaged("a texel holds more light than the lamp sends"));
            }
            texel[channel] = sum;
        }
    }
    Ok(())
}
