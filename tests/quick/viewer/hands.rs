//! What hands do in the picture, on the model: things are picked, points probed, maps kept to compare with, and cameras
//! recorded and played.

use egui_kittest::Harness;
use nephroid::viewer::command::CompareCommand;
use nephroid::viewer::comparison_view::{SavedMaps, show};

use super::*;

/// A baked scene in the window, with its event log.
fn baked(scene: &str) -> (Model, tempfile::NamedTempFile) {
    let log = tempfile::NamedTempFile::new().expect("a file");
    let mut model = fixtures::model(&with(options(scene), |it| {
        it.event_log = Some(log.path().to_owned())
    }));
    bake(&mut model);
    (model, log)
}

/// The ray from the camera through a point.
fn gaze(model: &Model, point: DVec3) -> Ray {
    let origin = model.navigator.camera().position;
    Ray {
        origin,
        direction: (point - origin).normalize(),
    }
}

#[test]
fn the_wall_that_is_clicked_is_picked() {
    let (mut model, log) = baked("ring");
    assert_eq!(model.choices.selection.held(), None);
    let inner_wall = gaze(&model, dvec3(0.0, 0.25, -1.0));
    model.pick(inner_wall);
    until(&mut model, "the pick", |model| {
        model.choices.selection.held() == Some(GizmoTarget::Object(1))
    });
    let told = events(log.path()).pop().expect("events");
    assert_eq!(
        (&told["event"], &told["name"]),
        (&json!("picked"), &json!("ring"))
    );
}

#[test]
fn a_probe_tells_what_lights_the_floor() {
    let (mut model, log) = baked("ball");
    let point = dvec3(0.2, 0.0, 0.1);
    let seen = gaze(&model, point);
    model.probe(Some(seen));
    until(&mut model, "the paths", |model| {
        model.probed().is_some_and(|probed| probed.explanation.is_some())
    });
    let probed = model.probed().expect("it is told");
    assert_eq!(probed.surface, "floor");
    near(probed.point, point, 1e-6, "the point");
    let paths = &probed.explanation.as_ref().expect("they are found").paths;
    assert!(paths.iter().any(|path| !path.vertices.is_empty()), "{paths:?}");
    let shares: f64 = paths.iter().map(|path| probed.share(path)).sum();
    near(shares, 1.0, 1e-9, "nothing else lights it");
    assert!(events(log.path()).iter().any(|event| event["event"] == "probe"));
    act(&mut model, vec![Command::ClearProbe]);
    assert!(model.probed().is_none());
}

#[test]
fn kept_maps_stay_while_the_lamp_gets_brighter() {
    let (mut model, _log) = baked("ring");
    let error = |model: &Model| model.reference.as_ref().map(|it| it.relative_rmse.clone());
    let total = |maps: &[IlluminationMap]| -> Vec<_> { maps.iter().map(IlluminationMap::total).collect() };
    act(&mut model, vec![Command::Compare(CompareCommand::Keep)]);
    assert_eq!(error(&model), Some(Ok(0.0)));
    let before = total(model.maps());

    let strength = model.scene().lights[0].kind.strength();
    act(&mut model, change(intensity(0, 4.0 * strength)));
    bake(&mut model);
    // Brighter by one factor everywhere: the maps differ by no less than their mean does.
    let off = error(&model).expect("it is kept").expect("it is lit");
    assert!(off > 1.0, "{off}");
    let (_, kept) = model.reference_to_show().expect("it is kept");
    assert_eq!(total(&kept), before);
    assert_ne!(total(model.maps()), before);
    act(&mut model, vec![Command::Compare(CompareCommand::End)]);
    assert!(model.reference_to_show().is_none());
}

#[test]
fn the_line_before_kept_maps_is_dragged_within_the_picture() {
    let scene = Arc::new(fixtures::scene());
    let kept = SavedMaps::kept(&scene, &[fixtures::map()]).expect("there are maps");
    let picture = Rect::from_min_size(pos2(360.0, 0.0), vec2(400.0, 300.0));
    let mut harness = Harness::builder().with_size(vec2(800.0, 300.0)).build_ui_state(
        |ui, divider| show(ui, picture, divider, (egui::TextureId::default(), &kept)),
        0.5,
    );
    for (from_x, to_x, share) in [(560.0, 400.0, 0.1), (400.0, 700.0, 0.85), (700.0, 100.0, 0.02)] {
        let [from, to] = [from_x, to_x].map(|x| pos2(x, 150.0));
        harness.hover_at(from);
        harness.drag_at(from);
        harness.run_steps(2);
        harness.hover_at(to);
        harness.run_steps(2);
        harness.drop_at(to);
        harness.run_steps(2);
        near(f64::from(*harness.state()), share, 0.01, (from_x, to_x));
    }
}

#[test]
fn a_recorded_path_is_gone_to_and_played() {
    let (mut model, log) = baked("ring");
    let film = |model: &mut Model, command| act(model, vec![Command::Film(command)]);
    let place = |model: &Model| model.navigator.camera().position;
    let start = place(&model);
    film(&mut model, FilmCommand::Record(None));
    let end = start + dvec3(0.5, 0.25, 0.0);
    let there = with(model.navigator.camera(), |camera| camera.position = end);
    model.navigator.stand_at(&there);
    film(&mut model, FilmCommand::Record(None));
    film(&mut model, FilmCommand::GoTo(0));
    near(place(&model), start, 1e-9, "the first key");

    film(&mut model, FilmCommand::Play(true));
    assert!(model.is_playing());
    let mut way = vec![start];
    for _ in 0..1000 {
        if model.is_playing() {
            model.advance(0.02);
            way.push(place(&model));
        }
    }
    assert!(!model.is_playing() && way.len() > 50, "{} pictures", way.len());
    near(place(&model), end, 1e-9, "the last key");
    let steps = way.windows(2).map(|pair| pair[0].distance(pair[1]));
    let longest = steps.fold(0.0, f64::max);
    assert!(longest < 0.1 * start.distance(end), "{longest} m at once");
    let told: Vec<_> = { events(log.path()).into_iter() }
        .filter_map(|event| event["event"].as_str().map(str::to_owned))
        .filter(|name| !["baking", "level", "done"].contains(&name.as_str()))
        .collect();
    assert_eq!(told, ["recorded", "recorded", "plays", "played"]);
}
