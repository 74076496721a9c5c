//! Keyframes of nodes: translation, rotation and scale, with all animations of the file merged.

use std::collections::HashMap;

use glam::{DQuat, DVec3, DVec4};
use gltf::json::{Index, Value};
use serde::Deserialize;
use serde_json::Map;

use super::accessor::{Formats, Reader};
use super::context::LoadContext;
use super::document::Document;
use super::extras;
use super::nodes::{self, PlacedNode};
use super::pose::Maybe;
use crate::error::Error;
use crate::scene::{Animated, Clip, ClipNode, Interpolation, Track};

/// Animations as stated in the file. Faults in them must not stop the scene.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Animations {
    animations: Vec<Maybe<Animation>>,
}

#[derive(Clone, Debug, Deserialize)]
struct Animation {
    name: Option<String>,
    channels: Vec<Channel>,
    samplers: Vec<Sampler>,
}

#[derive(Clone, Debug, Deserialize)]
struct Channel {
    sampler: usize,
    target: Target,
}

#[derive(Clone, Debug, Deserialize)]
struct Target {
    node: Option<usize>,
    path: String,
}

#[derive(Clone, Debug, Deserialize)]
struct Sampler {
    input: u32,
    output: u32,
    #[serde(default)]
    interpolation: Option<String>,
}

impl Animations {
    pub fn of(file: &Map<String, Value>) -> Self {
        Self::deserialize(file).unwrap_or_default()
    }

    /// Clip of all animations that move a node of the scene; `None` without any.
    pub fn read(
        &self,
        document: &Document,
        placed: &[PlacedNode],
        reader: Reader,
        load: &mut LoadContext,
    ) -> Option<Clip> {
        // A scene has one time line, on which all animations run at once.
        let mut tracks: HashMap<usize, Vec<Track>> = HashMap::new();
        for (index, animation) in self.animations.iter().enumerate() {
            let Some(animation) = animation.get() else {
                load.warn_damaged(
                    format!("animation {index}"),
                    "is not as glTF has it and is left out",
                );
                continue;
            };
            let name = extras::name(animation.name.as_deref(), "animation", index);
            let owner = format!("animation `{name}`");

            // Faults cost a channel, not the clip.
            for channel in &animation.channels {
                let read = node_of(channel, document)
                    .and_then(|node| Ok((node, track(animation, channel, reader, &owner, load)?)));
                match read {
                    Ok((node, track)) => {
                        // Of two channels for one part of a node, the first in the file wins.
                        let of_node = tracks.entry(node).or_default();
                        if of_node.iter().all(|other| other.animated != track.animated) {
                            of_node.push(track);
                        } else {
                            load.warn(
                                &owner,
                                format!("moves node {node} as another animation does, which is played"),
                                "leave one of them in the file",
                            );
                        }
                    }
                    Err(why) => load.warn_damaged(&owner, why),
                }
            }
        }
        clip(tracks, document, placed)
    }
}

/// The node that a channel moves.
fn node_of(channel: &Channel, document: &Document) -> Result<usize, String> {
    // Without a node, an extension states the target.
    let node = channel.target.node.filter(|_| channel.target.path != "pointer");
    let node = node.ok_or("moves something that is no node, which stays")?;
    match document.transforms.get(node) {
        None => Err(format!("moves node {node}, which does not exist")),
        Some(transform) if transform.matrix.is_some() => {
            Err(format!("moves node {node}, which stands by a matrix"))
        }
        Some(_) => Ok(node),
    }
}

/// Track of a channel, or the reason why it is left out.
fn track(
    animation: &Animation,
    channel: &Channel,
    reader: Reader,
    owner: &str,
    load: &mut LoadContext,
) -> Result<Track, String> {
    // Only transforms of nodes are played.
    let animated = match channel.target.path.as_str() {
        "translation" => Animated::Translation,
        "rotation" => Animated::Rotation,
        "scale" => Animated::Scale,
        "weights" => return Err("moves weights of morph targets, which stay at rest".into()),
        path => return Err(format!("moves `{path}`, which no node has")),
    };
    let sampler = animation.samplers.get(channel.sampler);
    let sampler = sampler.ok_or("has a channel without a sampler")?;
    let interpolation = match sampler.interpolation.as_deref() {
        None | Some("LINEAR") => Interpolation::Linear,
        Some("STEP") => Interpolation::Step,
        Some("CUBICSPLINE") => Interpolation::CubicSpline,
        Some(_) => return Err("has an interpolation that glTF does not know".into()),
    };

    // All parts are kept as four numbers, of which translations and scales leave the last one 0.
    let (input, output) = (Index::new(sampler.input), Index::new(sampler.output));
    let what = |error: Error| error.what;
    let times = reader.vectors::<1>(input, Formats::Float, owner, load);
    let values = match animated {
        Animated::Rotation => reader
            .vectors::<4>(output, Formats::FloatOrSigned, owner, load)
            .map(|values| values.into_iter().map(DVec4::from).collect()),
        Animated::Translation | Animated::Scale => reader
            .vectors::<3>(output, Formats::Float, owner, load)
            .map(|values| {
                values
                    .into_iter()
                    .map(|value| DVec3::from(value).extend(0.0))
                    .collect()
            }),
    };

    // What is kept was checked: times ascend, and rotations are of unit length.
    let (times, values): (_, Vec<DVec4>) = (times.map_err(what)?, values.map_err(what)?);
    let mut track = Track {
        animated,
        times_s: times.into_iter().map(|[time]| time).collect(),
        values,
        interpolation,
    };
    check(&mut track)?;
    Ok(track)
}

/// Checks the values of a track and normalises its rotations.
fn check(track: &mut Track) -> Result<(), &'static str> {
    let per_keyframe = match track.interpolation {
        Interpolation::CubicSpline => 3,
        Interpolation::Step | Interpolation::Linear => 1,
    };
    if track.times_s.is_empty() || track.values.len() != per_keyframe * track.times_s.len() {
        return Err("has another number of values than of times");
    }
    if per_keyframe > 1 && track.times_s.len() < 2 {
        return Err("has a cubic through a single keyframe");
    }
    let is_ascending = track.times_s.windows(2).all(|pair| pair[0] < pair[1]);
    if !is_ascending || track.times_s[0] < 0.0 || !track.times_s.iter().all(|time| time.is_finite()) {
        return Err("has times that do not ascend");
    }
    if !track.values.iter().all(|value| value.is_finite()) {
        return Err("has a value that is infinite or not a number");
    }
    if track.animated == Animated::Rotation {
        for value in track
            .values
            .iter_mut()
            .skip(per_keyframe / 2)
            .step_by(per_keyframe)
        {
            *value = value.normalize_or(DVec4::from(DQuat::IDENTITY));
        }
    }
    Ok(())
}

fn clip(mut tracks: HashMap<usize, Vec<Track>>, document: &Document, placed: &[PlacedNode]) -> Option<Clip> {
    // Nodes are posed relative to their parents, which the clip therefore keeps, moving or not.
    let parents: HashMap<usize, usize> = document
        .root
        .nodes
        .iter()
        .enumerate()
        .flat_map(|(parent, node)| {
            let children = node.children.as_deref().unwrap_or_default();
            children.iter().map(move |child| (child.value(), parent))
        })
        .collect();
    let places: HashMap<usize, usize> = placed
        .iter()
        .enumerate()
        .map(|(place, of)| (of.node, place))
        .collect();

    // Whatever an object, a light or a camera may hang on is kept, which is any placed node.
    let nodes: Vec<ClipNode> = placed
        .iter()
        .enumerate()
        .map(|(place, of)| {
            // Parents stand before their children; a node that is its own ancestor was placed once.
            let parent = parents.get(&of.node).and_then(|parent| places.get(parent));
            let (at_rest, pose) = nodes::at_rest(document, of.node);
            ClipNode {
                node: of.node,
                parent: parent.copied().filter(|parent| *parent < place),
                at_rest,
                pose,
                // A skinned mesh is placed by its joints, which stay at rest.
                is_carried: !document.poses.has_skin(of.node),
                tracks: tracks.remove(&of.node).unwrap_or_default(),
            }
        })
        .collect();

    // Without a keyframe there is no clip; it starts over after the last one.
    let all = nodes.iter().flat_map(|node| &node.tracks);
    let ends = all.filter_map(|track| track.times_s.last().copied());
    let duration_s = ends.reduce(f64::max)?;
    Some(Clip {
        nodes,
        duration_s,
        ..Clip::default()
    })
}
