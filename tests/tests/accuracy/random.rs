//! `organza accuracy`: techniques whose pictures are random.

use super::*;

/// A sweep of repeat levels from `sweep`'s scene.
fn repeats() -> Sweep {
    particles(&scene(), &FEW, &OPTIONS).unwrap()
}

/// The exact picture with noise of variance 0.01/`repeat level`, which `seed_of` chooses; `bias` is added everywhere.
pub(super) fn noisy(seed_of: fn(u64, u32) -> u64, bias: f64) -> Study {
    let limit = run(0.5).unwrap().limit;
    let mut draw = |request: &Request| {
        let (render, level) = (&request.scene.render, request.scene.render.particles.repeat_level);
        let seed = seed_of(render.seed, level);
        let deviation = 0.1 / f64::from(level).sqrt();
        let value =
            |k: usize, c: u64| 12f64.sqrt() * (splat_core::rng::unit(seed, 1, k as u64, c) - 0.5) * deviation + bias;
        let pixel = |(k, p): (usize, &[f64; 3])| [p[0] + value(k, 0), p[1] + value(k, 1), p[2] + value(k, 2)];
        let pixels = exact_image().pixels().iter().enumerate().map(pixel).collect();
        Ok(frame(Image::from_radiance(SIZE, pixels).unwrap(), 1e-3 * f64::from(level)))
    };
    random_study(
        &repeats(),
        Yardsticks { limit: &limit, truth: Err("a test".into()) },
        &OPTIONS,
        &Progress::new(),
        &mut draw,
    )
    .unwrap()
}

#[test]
fn a_random_technique_has_intervals_and_its_noise_falls_with_the_root_of_the_repeat_level() {
    let study = noisy(|seed, level| seed + 1000 * u64::from(level), 0.0);
    let (order, half) = order_of(&study, "repeat level");
    assert!((order - 0.5).abs() < 0.03 && half < 0.06, "{order} ± {half}");
    assert!(verdict(&study, &study.curves[0]).contains("as theory says: 0.47 to 0.53"));
    // Nothing is refused, and the intervals hold what is known.
    assert!(study.outcomes.iter().all(|o| o.drawn));
    for o in &study.outcomes {
        let sampled = o.sampled.unwrap();
        let level = o.setting.request.scene.render.particles.repeat_level;
        let deviation = 0.1 / f64::from(level).sqrt();
        assert!((sampled.noise / deviation - 1.0).abs() < 0.05, "{level}: {sampled:?}");
        assert!((sampled.from_limit.mean - deviation).abs() <= sampled.from_limit.half_width, "{level}: {sampled:?}");
        // 1152 numbers in five pictures: four standard errors.
        assert!(sampled.bias.is_none_or(|b| b < 0.19 * deviation), "{level}: {sampled:?}");
        assert_eq!((sampled.seeds, o.timed.seconds.len()), (5, 6), "five seeds, and a round that the frontier held");
    }
    let bias = noisy(|seed, level| seed + 1000 * u64::from(level), 0.05);
    assert!(bias.outcomes.iter().all(|o| (o.sampled.unwrap().bias.unwrap() / 0.05 - 1.0).abs() < 0.1));
    assert!((order_of(&bias, "repeat level").0 - 0.5).abs() < 0.03, "bias is no noise");
}

#[test]
fn sets_that_are_not_independent_show_up_in_the_report() {
    // Twice the level adds nothing: what is drawn is that of level 2, but the noise that comes with it.
    let limit = run(0.5).unwrap().limit;
    let mut draw = |request: &Request| {
        let seed = request.scene.render.seed;
        let value = |k: usize| [0.5 + 0.1 * splat_core::rng::unit(seed, 1, k as u64, 0); 3];
        let image = Image::from_radiance(SIZE, (0..SIZE[0] * SIZE[1]).map(value).collect()).unwrap();
        Ok(frame(image, 1e-3))
    };
    let study = random_study(
        &repeats(),
        Yardsticks { limit: &limit, truth: Err("a test".into()) },
        &OPTIONS,
        &Progress::new(),
        &mut draw,
    )
    .unwrap();
    assert!(verdict(&study, &study.curves[0]).contains("theory says otherwise"));
}

/// Pictures whose noise is a hundredth more at levels up to 8, which take less time: five seeds do not tell such errors apart.
fn nearly_equal() -> Study {
    let limit = run(0.5).unwrap().limit;
    let mut draw = |request: &Request| {
        let level = request.scene.render.particles.repeat_level;
        let seed = request.scene.render.seed + 1000 * u64::from(level);
        let deviation = if level <= 8 { 0.1565 } else { 0.1535 };
        let value = |k: usize, c: u64| 12f64.sqrt() * (splat_core::rng::unit(seed, 1, k as u64, c) - 0.5) * deviation;
        let noisy = |(k, p): (usize, &[f64; 3])| [0, 1, 2].map(|c| p[c] + value(k, c as u64));
        let pixels = exact_image().pixels().iter().enumerate().map(noisy).collect();
        Ok(frame(Image::from_radiance(SIZE, pixels).unwrap(), 1e-3 * f64::from(level)))
    };
    let yardsticks = Yardsticks { limit: &limit, truth: Err("a test".into()) };
    random_study(&repeats(), yardsticks, &OPTIONS, &Progress::new(), &mut draw).unwrap()
}

#[test]
fn errors_that_differ_by_noise_alone_are_one_row_of_the_frontier() {
    let study = nearly_equal();
    let errors: Vec<String> = study
        .outcomes
        .iter()
        .map(|outcome| format!("{:.1e}", outcome.from_limit.as_ref().unwrap().linear.rmse))
        .collect();
    assert!(errors.iter().any(|error| *error != errors[0]), "two digits differ: {errors:?}");
    let report = Report::new(&scene(), OPTIONS, vec![study], Vec::new());
    let rows: Vec<&String> = report.frontier.iter().map(|[_, outcome]| &errors[*outcome]).collect();
    assert_eq!(rows.len(), 1, "{rows:?}");
}

#[test]
fn a_slope_whose_interval_is_wider_than_itself_is_not_printed_as_an_order() {
    let study = nearly_equal();
    let said = verdict(&study, &study.curves[0]);
    assert!(said.starts_with("No order: slope ") && !said.contains("as theory says"), "{said}");
    let report = Report::new(&scene(), OPTIONS, vec![study], Vec::new());
    let document: Value = serde_json::from_str(&report.json()).unwrap();
    let curve = &document["techniques"][0]["curves"][0];
    assert!(curve["order"].is_null() && curve["order_half_width_95"].is_null(), "{curve}");
    let [slope, half_width] = ["slope", "slope_half_width_95"].map(|key| curve[key].as_f64().unwrap());
    assert!(slope.abs() < 2.0 * half_width, "{slope} ± {half_width}");
}
