//! The scene at a moment: running waves, water surfaces that they lift, and keyframed nodes.

use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3, DVec4};

use super::{Mesh, Scene, Waves, contacts};

/// Animated part of a node's transform.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Animated {
    /// [m]
    Translation,
    /// A unit quaternion x, y, z, w.
    Rotation,
    /// Per axis [1].
    Scale,
}

/// Interpolation between keyframes (glTF 2.0, appendix C).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Holds the previous keyframe.
    Step,
    /// Linear; along the shortest arc for rotations.
    Linear,
    /// Cubic; each keyframe has an in-tangent, a value and an out-tangent [per s].
    CubicSpline,
}

/// Keyframes of one part of a node's transform.
#[derive(Clone, Debug)]
pub struct Track {
    /// Which part.
    pub animated: Animated,
    /// Ascending [s], at least one.
    pub times_s: Vec<f64>,
    /// One for each time, or three for a cubic.
    pub values: Vec<DVec4>,
    /// Interpolation between the keyframes.
    pub interpolation: Interpolation,
}

impl Track {
    /// Value at a time; the first and the last keyframe hold outside the range.
    pub fn at(&self, time_s: f64) -> DVec4 {
        let next = self.times_s.partition_point(|time| *time <= time_s);
        let last = self.times_s.len() - 1;
        if next == 0 || next > last {
            return self.value(next.min(last));
        }
        let (from, to) = (self.times_s[next - 1], self.times_s[next]);
        let (step_s, share) = (to - from, (time_s - from) / (to - from));
        let (a, b) = (self.value(next - 1), self.value(next));
        match self.interpolation {
            Interpolation::Step => a,
            Interpolation::Linear if self.animated == Animated::Rotation => {
                DVec4::from(DQuat::from_vec4(a).slerp(DQuat::from_vec4(b), share))
            }
            Interpolation::Linear => a.lerp(b, share),
            Interpolation::CubicSpline => {
                let (square, cube) = (share * share, share * share * share);
                let (leaving, arriving) = (self.values[3 * next - 1], self.values[3 * next]);
                let cubic = a * (2.0 * cube - 3.0 * square + 1.0)
                    + leaving * (step_s * (cube - 2.0 * square + share))
                    + b * (3.0 * square - 2.0 * cube)
                    + arriving * (step_s * (cube - square));
                match self.animated {
                    Animated::Rotation => cubic.normalize_or(a),
                    Animated::Translation | Animated::Scale => cubic,
                }
            }
        }
    }

    fn value(&self, keyframe: usize) -> DVec4 {
        match self.interpolation {
            Interpolation::CubicSpline => self.values[3 * keyframe + 1],
            Interpolation::Step | Interpolation::Linear => self.values[keyframe],
        }
    }
}

/// A placed node of the file, moving or not.
#[derive(Clone, Debug)]
pub struct ClipNode {
    /// glTF index.
    pub node: usize,
    /// Index of its parent among the nodes of the clip.
    pub parent: Option<usize>,
    /// From node to parent coordinates, at rest.
    pub at_rest: DAffine3,
    /// `at_rest` as scale, rotation and translation [m], for nodes with tracks.
    pub pose: (DVec3, DQuat, DVec3),
    /// Whether what is attached to it moves along; false for a skinned mesh.
    pub is_carried: bool,
    /// Keyframes of its transform.
    pub tracks: Vec<Track>,
}

impl ClipNode {
    fn parent_from_node(&self, time_s: f64) -> DAffine3 {
        if self.tracks.is_empty() {
            return self.at_rest;
        }
        let (mut scale, mut rotation, mut translation) = self.pose;
        for track in &self.tracks {
            let value = track.at(time_s);
            match track.animated {
                Animated::Translation => translation = value.truncate(),
                Animated::Rotation => rotation = DQuat::from_vec4(value),
                Animated::Scale => scale = value.truncate(),
            }
        }
        DAffine3::from_scale_rotation_translation(scale, rotation, translation)
    }
}

/// Keyframes of the nodes of a file.
#[derive(Clone, Debug, Default)]
pub struct Clip {
    /// Parents before their children.
    pub nodes: Vec<ClipNode>,
    /// Time of the last keyframe [s], after which the clip starts over.
    pub duration_s: f64,
    /// glTF index of the node of each of the first lights of the scene; further lights have none.
    pub light_nodes: Vec<usize>,
    /// glTF index of the node of each camera of the scene.
    pub camera_nodes: Vec<usize>,
}

/// glTF index of a node, and the world transform from its place at rest to that at some time.
type Carrying = (usize, DAffine3);

impl Clip {
    /// Nodes that are not at rest at a time, in ascending order. One that is scaled to zero stays at rest.
    fn moved(&self, time_s: f64) -> Vec<Carrying> {
        let time_s = match self.duration_s > 0.0 && time_s > self.duration_s {
            true => time_s % self.duration_s,
            false => time_s,
        };
        let mut worlds: Vec<[DAffine3; 2]> = Vec::with_capacity(self.nodes.len());
        let mut moved = Vec::new();
        for node in &self.nodes {
            let [rest, now] = node
                .parent
                .map_or([DAffine3::IDENTITY; 2], |parent| worlds[parent]);
            let world = [rest * node.at_rest, now * node.parent_from_node(time_s)];
            worlds.push(world);
            let [rest, now] = world;
            let carrying = now * rest.inverse();
            let is_moved = node.is_carried && now != rest;
            if is_moved && carrying.is_finite() && carrying.matrix3.determinant() != 0.0 {
                moved.push((node.node, carrying));
            }
        }
        moved.sort_by_key(|(node, _)| *node);
        moved
    }
}

impl Scene {
    /// Whether anything moves by itself.
    pub fn is_animated(&self) -> bool {
        self.why_animated().is_some()
    }

    /// Describes what moves by itself; `None` if nothing does.
    pub fn why_animated(&self) -> Option<String> {
        let runs = |object: &usize| {
            let waves = self.material_of(*object).bending_waves();
            waves.is_some_and(Waves::is_moving)
        };
        let water = (0..self.objects.len()).find(runs);
        let clip = self.clip.as_ref().map(|clip| {
            let moved = clip.nodes.iter().filter(|node| !node.tracks.is_empty());
            format!(
                "keyframes of {:.3} s move {} nodes",
                clip.duration_s,
                moved.count()
            )
        });
        let water = water.map(|object| format!("waves run over `{}`", self.objects[object].name));
        let ways: Vec<String> = water.into_iter().chain(clip).collect();
        (!ways.is_empty()).then(|| ways.join(", "))
    }

    /// The scene at a time [s] after this one: waves advanced, nodes posed by their keyframes, surfaces that now meet
    /// set apart. Whatever does not move is shared.
    #[must_use]
    pub fn at(&self, time_s: f64) -> Self {
        let mut scene = self.clone();
        for material in &mut scene.materials {
            material.waves = material.waves.as_ref().map(|waves| waves.after(time_s));
        }
        if let Some(clip) = &self.clip {
            scene.carry(clip, &clip.moved(time_s));
        }
        scene.displace_by_waves();
        if self.clip.is_some() {
            let covering = contacts::set_apart(&mut scene, Some(self));
            scene.warnings.extend(covering);
        }
        scene
    }

    /// The scene with wave periods adjusted so that a whole number of each fits a duration [s].
    #[must_use]
    pub fn looped(&self, duration_s: f64) -> Self {
        let mut scene = self.clone();
        for material in &mut scene.materials {
            material.waves = material.waves.as_ref().map(|waves| waves.looped(duration_s));
        }
        scene
    }

    fn carry(&mut self, clip: &Clip, moved: &[Carrying]) {
        let origin = DAffine3::from_translation(self.origin_world);
        let of = |node: usize| {
            let found = moved.binary_search_by_key(&node, |(node, _)| *node).ok()?;
            Some(origin.inverse() * moved[found].1 * origin)
        };
        for object in &mut self.objects {
            if let Some(carrying) = of(object.node) {
                object.carry(&carrying);
            }
        }
        for light in 0..self.lights.len() {
            let loaded = self.original_light_index(light);
            let node = loaded.and_then(|loaded| clip.light_nodes.get(loaded));
            if let Some(carrying) = node.and_then(|node| of(*node)) {
                let kind = &mut self.lights[light].kind;
                *kind = kind.carried(&carrying);
            }
        }
        for (camera, node) in self.cameras.iter_mut().zip(&clip.camera_nodes) {
            if let Some(carrying) = of(*node) {
                camera.carry(&carrying);
            }
        }
    }

    /// Displaces the vertices of `swells` by their waves.
    pub fn displace_by_waves(&mut self) {
        for (object, flat) in &self.swells {
            let Some(object) = self.objects.get_mut(*object) else {
                continue;
            };
            let waves = self.materials[object.material].waves.as_ref();
            let mesh = displaced_mesh(flat, waves, object.world_from_object());
            if **object.mesh() != mesh {
                object.reshape(Arc::new(mesh));
            }
        }
    }
}

/// Surface at rest with its vertices displaced along their normals.
fn displaced_mesh(flat: &Mesh, waves: Option<&Waves>, scene_from_mesh: &DAffine3) -> Mesh {
    let mut mesh = flat.clone();
    let Some(waves) = waves else { return mesh };
    for (position, normal) in mesh.positions.iter_mut().zip(&flat.normals) {
        *position += *normal * waves.height_m(scene_from_mesh.transform_point3(*position));
    }
    mesh
}

/// A unit vector, transformed and normalised; unchanged if the transform collapses it.
pub(super) fn turned(direction: DVec3, transform: &DAffine3) -> DVec3 {
    transform.transform_vector3(direction).normalize_or(direction)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    fn track(animated: Animated, interpolation: Interpolation, values: Vec<DVec4>) -> Track {
        Track {
            animated,
            times_s: vec![1.0, 3.0],
            values,
            interpolation,
        }
    }

    #[test]
    fn keyframes_are_met_and_held_outside() {
        let (a, b) = (DVec4::new(1.0, 2.0, 3.0, 0.0), DVec4::new(5.0, 2.0, -1.0, 0.0));
        let tangent = DVec4::new(0.3, -2.0, 7.0, 0.0);
        for (interpolation, values) in [
            (Interpolation::Step, vec![a, b]),
            (Interpolation::Linear, vec![a, b]),
            (
                Interpolation::CubicSpline,
                vec![tangent, a, tangent, tangent, b, tangent],
            ),
        ] {
            let track = track(Animated::Translation, interpolation, values);
            for (time_s, value) in [(0.0, a), (1.0, a), (3.0, b), (9.0, b)] {
                assert_eq!(track.at(time_s), value, "{interpolation:?} at {time_s} s");
            }
        }
    }

    #[test]
    fn a_cubic_with_the_slope_of_a_line_is_that_line() {
        let (a, b) = (DVec4::new(1.0, 2.0, 3.0, 0.0), DVec4::new(5.0, 2.0, -1.0, 0.0));
        let slope = (b - a) / 2.0;
        let values = vec![slope, a, slope, slope, b, slope];
        let cubic = track(Animated::Scale, Interpolation::CubicSpline, values);
        let line = track(Animated::Scale, Interpolation::Linear, vec![a, b]);
        for step in 0..=20 {
            let time_s = 1.0 + 0.1 * f64::from(step);
            assert!((cubic.at(time_s) - line.at(time_s)).length() < 1e-12);
        }
        let held = track(Animated::Scale, Interpolation::Step, vec![a, b]);
        assert_eq!(held.at(2.9), a);
    }

    #[test]
    fn rotations_take_the_shortest_arc() {
        let quarter = DQuat::from_rotation_y(FRAC_PI_2);
        // The same rotation as the opposite quaternion.
        let values = vec![DVec4::W, -DVec4::from(quarter)];
        let track = track(Animated::Rotation, Interpolation::Linear, values);
        let half = DQuat::from_vec4(track.at(2.0));
        assert!(half.dot(DQuat::from_rotation_y(0.5 * FRAC_PI_2)).abs() > 1.0 - 1e-12);
    }

    #[test]
    fn children_move_with_their_parents() {
        let node = |node, parent, at_rest: DAffine3, tracks| ClipNode {
            node,
            parent,
            at_rest,
            pose: at_rest.to_scale_rotation_translation(),
            is_carried: true,
            tracks,
        };
        let quarter = DVec4::from(DQuat::from_rotation_y(FRAC_PI_2));
        let turning = track(Animated::Rotation, Interpolation::Linear, vec![DVec4::W, quarter]);
        let clip = Clip {
            nodes: vec![
                node(7, None, DAffine3::IDENTITY, vec![turning]),
                node(2, Some(0), DAffine3::from_translation(DVec3::X), vec![]),
            ],
            duration_s: 3.0,
            ..Clip::default()
        };
        assert!(clip.moved(1.0).is_empty(), "at rest");
        let moved = clip.moved(3.0);
        assert_eq!(moved.iter().map(|(node, _)| *node).collect::<Vec<_>>(), [2, 7]);
        for (_, carrying) in moved {
            let place = carrying.transform_point3(DVec3::X);
            assert!(place.distance(DVec3::NEG_Z) < 1e-12, "{place}");
        }
    }
}
