//! The files of a comparison of orderings: JSON, CSV, a contact sheet, and a page.

use super::{Comparison, Ordered};
use crate::accuracy::{COLORS, Mark, Plot, SHARED_COLUMNS, Series, data_uri, difference, escaped, png};
use crate::accuracy::{Distance, Machine};
use organza::output::{Target, Targets};
use organza::scene::Scene;
use organza::{Error, printable};
use reference::metrics::{Display, Image, Linear};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The contents of the report's files.
#[derive(Debug, Clone)]
pub struct OrdersReport {
    scene: String,
    scene_sha256: String,
    exposure: f64,
    machine: Machine,
    comparison: Comparison,
    /// Of each ordering from the truth.
    distances: Vec<Distance>,
}

impl OrdersReport {
    /// Measures every ordering against the truth.
    ///
    /// # Errors
    /// [`Error::Internal`] for pictures of unequal sizes.
    pub fn new(scene: &Scene, comparison: Comparison) -> Result<Self, Error> {
        let exposure = scene.render.exposure;
        let distance = |o: &Ordered| Distance::between(&o.image, truth(o, &comparison), exposure);
        let distances = comparison.orderings.iter().map(distance).collect::<Result<_, _>>()?;
        Ok(Self {
            scene: printable(Path::new(scene.file.file_name().unwrap_or_default())),
            scene_sha256: scene.sha256.clone(),
            exposure,
            machine: Machine::this(),
            comparison,
            distances,
        })
    }

    /// Checks before any work that the files of [`write()`] can be written to a folder; none may be one of the `inputs`.
    ///
    /// # Errors
    /// As [`Targets::add`].
    pub fn check(folder: &Path, force: bool, inputs: &[PathBuf]) -> Result<[Target; 4], Error> {
        let mut targets = Targets::default();
        targets.add_inputs(inputs);
        let mut add = |name: &str| targets.add(&folder.join(name), force);
        Ok([add("orders.json")?, add("orders.csv")?, add("orders.html")?, add("orders.png")?])
    }

    fn rows(&self) -> impl Iterator<Item = (&Ordered, &Distance)> {
        self.comparison.orderings.iter().zip(&self.distances)
    }

    /// The comparison as a JSON document.
    pub fn json(&self) -> String {
        let row = |(o, d): (&Ordered, &Distance)| {
            json!({
                "ordering": o.name,
                "slice_thickness": o.thickness,
                "wrong_pairs_per_ray": o.disorder.map(|d| d.wrong_pairs_per_ray),
                "pairs_per_ray": o.disorder.map(|d| d.pairs_per_ray),
                "worst_backtrack": o.disorder.map(|d| d.worst_backtrack),
                "rmse": d.linear.rmse,
                "max": d.linear.max,
                "flip": d.flip,
                "epsilon_8_bit": d.epsilon,
                "of_layers": o.of_layers,
                "pop_score": o.pop,
                "sort_seconds": o.seconds.map(|s| json!({ "median": s.median, "min": s.min, "max": s.max })),
                "bytes": o.bytes,
                "sampled": o.sampled.map(|s| json!({
                    "seeds": s.seeds,
                    "rmse": { "mean": s.from_limit.mean, "half_width_95": s.from_limit.half_width },
                    "standard_deviation": s.noise,
                    "rms_bias": s.bias,
                })),
            })
        };
        let document = json!({
            "scene": self.scene,
            "scene_sha256": self.scene_sha256,
            "version": env!("CARGO_PKG_VERSION"),
            "size": self.comparison.truth.size(),
            "machine": { "cpu": self.machine.cpu, "system": self.machine.system, "threads": self.machine.threads },
            "translucent_splats": self.comparison.splats,
            "rays": self.comparison.orderings.iter().find_map(|o| o.disorder).map(|d| d.rays),
            "without_particles": self.comparison.without_particles,
            "without_layers": self.comparison.layers.as_ref().err(),
            "interrupted": self.comparison.interrupted,
            "truth": { "method": "fragments sorted per pixel, f64", "seconds": self.comparison.truth_seconds },
            "orderings": self.rows().map(row).collect::<Value>(),
        });
        format!("{document:#}\n")
    }

    /// The report as CSV: a row for each ordering. Every row begins with the scene, the picture's size and the
    /// machine.
    pub fn csv(&self) -> String {
        let mut text = format!(
            "{SHARED_COLUMNS},ordering,slice_thickness_world,wrong_pairs_per_ray,pairs_per_ray,worst_backtrack_world,rmse_radiance,\
             max_radiance,flip,sort_ms,bytes,rmse_half_width_95_radiance,rms_bias_radiance,pop_score,epsilon_8_bit,of_layers\n",
        );
        let shared = self.machine.shared_cells(&self.scene, self.comparison.truth.size());
        let cell = |v: Option<f64>| v.map_or_else(String::new, |v| format!("{v:.6e}"));
        for (o, d) in self.rows() {
            let _ = writeln!(
                text,
                "{shared},\"{}\",{},{},{},{},{:.6e},{:.6e},{:.6e},{},{},{},{},{},{:.6e},{}",
                o.name,
                cell(o.thickness),
                cell(o.disorder.map(|d| d.wrong_pairs_per_ray)),
                cell(o.disorder.map(|d| d.pairs_per_ray)),
                cell(o.disorder.map(|d| d.worst_backtrack)),
                d.linear.rmse,
                d.linear.max,
                d.flip,
                cell(o.seconds.map(|s| 1e3 * s.median)),
                o.bytes,
                cell(o.sampled.map(|s| s.from_limit.half_width)),
                cell(o.sampled.and_then(|s| s.bias)),
                cell(o.pop),
                d.epsilon,
                o.of_layers,
            );
        }
        text
    }

    /// The comparison as lines of text.
    pub fn text(&self) -> String {
        let mut text = format!(
            "{:>12} {:>12} {:>10} {:>10} {:>8} {:>7} {:>9} {:>11}  ordering\n",
            "wrong pairs", "backtrack", "RMSE", "max", "ε", "pops", "ms", "bytes"
        );
        for (o, d) in self.rows() {
            let ms = o.seconds.map_or_else(|| "-".into(), |s| format!("{:.2}", 1e3 * s.median));
            let _ = writeln!(
                text,
                "{:>12} {:>12} {:>10.2e} {:>10.2e} {:>8.3} {:>7} {ms:>9} {:>11}  {}{}",
                o.disorder.map_or_else(|| "-".into(), |d| format!("{:.3}", d.wrong_pairs_per_ray)),
                o.disorder.map_or_else(|| "-".into(), |d| format!("{:.4}", d.worst_backtrack)),
                d.linear.rmse,
                d.linear.max,
                d.epsilon,
                pops(o, "-"),
                o.bytes,
                o.name,
                seeds(o)
            );
        }
        if let Some(stage) = self.comparison.interrupted {
            let _ = writeln!(text, "interrupted at {stage}: nothing stands here of what comes after");
            return text;
        }
        if let Some(reason) = &self.comparison.without_particles {
            let _ = writeln!(text, "no particles: {reason}");
        }
        match &self.comparison.layers {
            Ok(_) => {
                text +=
                    "layers are held against all layers, each averaged, in f64; other orderings against all fragments\n"
            }
            Err(reason) => {
                let _ = writeln!(text, "no layers: {reason}");
            }
        }
        text
    }

    fn shown(&self, o: &Ordered) -> Image<Display> {
        o.image.display(self.exposure)
    }

    /// Pictures in a row, their differences from the truth below; the truth comes first.
    fn contact_sheet(&self) -> Result<Vec<u8>, Error> {
        let exact = self.comparison.truth.display(self.exposure);
        let mut columns = vec![(exact.clone(), difference(&exact, &exact)?.0)];
        for o in &self.comparison.orderings {
            let shown = self.shown(o);
            let apart = difference(&shown, &truth(o, &self.comparison).display(self.exposure))?.0;
            columns.push((shown, apart));
        }
        let [width, height] = exact.size();
        let per_row = 3;
        let blocks = columns.len().div_ceil(per_row);
        let size = [per_row * width, 2 * blocks * height];
        let mut bytes = vec![0; 3 * size[0] * size[1]];
        for (k, (picture, apart)) in columns.iter().enumerate() {
            for (part, image) in [picture, apart].into_iter().enumerate() {
                let at = [k % per_row * width, (2 * (k / per_row) + part) * height];
                for (y, row) in image.bytes().chunks_exact(3 * width).enumerate() {
                    let from = 3 * ((at[1] + y) * size[0] + at[0]);
                    bytes[from..from + 3 * width].copy_from_slice(row);
                }
            }
        }
        png(&bytes, size)
    }

    fn html(&self) -> Result<String, Error> {
        let exact = self.comparison.truth.display(self.exposure);
        let mut html = format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
             content=\"width=device-width\"><title>Orders: {0}</title>\n<style>\n{1}</style></head>\n<body><main>\n<h1>Orders: \
             {0}</h1>\n<p class=\"soft\">{2} translucent splats; truth: fragments sorted per pixel in f64 ({3:.1} s). {4} \
             threads on {5}.<br>Scene SHA-256 <code>{6}</code></p>\n<div class=\"wide\"><table><tr><th>ordering</th>\
             <th>wrong pairs a ray</th><th>worst backtrack</th><th>RMSE</th><th>max</th><th>FLIP</th><th>ε</th><th>pops</th><th>sort ms</th>\
             <th>bytes</th></tr>\n",
            escaped(&self.scene),
            include_str!("../accuracy/report/report.css"),
            self.comparison.splats,
            self.comparison.truth_seconds,
            self.machine.threads,
            escaped(self.machine.cpu.as_deref().unwrap_or("an unnamed processor")),
            self.scene_sha256
        );
        for (o, d) in self.rows() {
            let pairs = o
                .disorder
                .map_or_else(|| "–".into(), |d| format!("{:.3} of {:.0}", d.wrong_pairs_per_ray, d.pairs_per_ray));
            let ms = o.seconds.map_or_else(|| "–".into(), |s| format!("{:.2}", 1e3 * s.median));
            let _ = writeln!(
                html,
                "<tr><td>{}{}</td><td>{pairs}</td><td>{}</td><td>{:.2e}</td><td>{:.2e}</td><td>{:.4}</td><td>{:.3}</td><td>{}</td><td>{ms}</td>\
                 <td>{}</td></tr>",
                o.name,
                seeds(o),
                o.disorder.map_or_else(|| "–".into(), |d| format!("{:.4}", d.worst_backtrack)),
                d.linear.rmse,
                d.linear.max,
                d.flip,
                d.epsilon,
                pops(o, "–"),
                o.bytes
            );
        }
        html += "</table></div>\n";
        if let Some(stage) = self.comparison.interrupted {
            let _ = writeln!(html, "<p>Interrupted at {stage}: nothing stands here of what comes after.</p>");
        }
        self.pops_by_thickness(&mut html);
        let _ = writeln!(
            html,
            "<h2>Pictures</h2>\n<p>Click a picture to flip between the ordering, the truth and their \
             difference.</p>\n<img hidden id=\"truth\" alt=\"\" src=\"{}\">",
            data_uri(&exact)?
        );
        if let Ok(layers) = &self.comparison.layers {
            let layers_uri = data_uri(&layers.display(self.exposure))?;
            let _ = write!(html, "<img hidden id=\"layers\" alt=\"\" src=\"{layers_uri}\">");
        }
        html += "<div class=\"grid\">";
        self.figures(&mut html)?;
        let _ = write!(
            html,
            "</div></main>\n<script>\n{}</script></body></html>\n",
            include_str!("../accuracy/report/report.js")
        );
        Ok(html)
    }

    /// How much sheets pop, by their thickness and by what they lie across.
    fn pops_by_thickness(&self, html: &mut String) {
        let mut series: Vec<(&str, Series)> = Vec::new();
        for o in &self.comparison.orderings {
            let (Some(pop), Some(thickness)) = (o.pop, o.thickness) else { continue };
            let (across, _) = o.name.split_once(", ").unwrap_or((&o.name, ""));
            let point = ([thickness, pop], format!("{}: {pop:.2}", o.name));
            match series.iter_mut().find(|(name, _)| *name == across) {
                Some((_, series)) => series.points.push(point),
                None => {
                    let color = COLORS[series.len() % COLORS.len()].to_owned();
                    series.push((across, Series { color, mark: Mark::Dots, points: vec![point] }));
                }
            }
        }
        if series.is_empty() {
            return;
        }
        let legend: String = series
            .iter()
            .map(|(name, series)| format!("<span><i style=\"background:{}\"></i>{name}</span>", series.color))
            .collect();
        let plot = Plot {
            size: [640.0, 320.0],
            x_label: "thickness of a sheet, world units".into(),
            y_label: "largest step between frames, over that of exact order".into(),
            floor: None,
            series: series.into_iter().map(|(_, series)| series).collect(),
        };
        let _ = writeln!(html, "<h2>Popping</h2>\n<figure>{}<div class=\"legend\">{legend}</div></figure>", plot.svg());
    }

    /// Each picture, which flips to what it is judged by and to their difference.
    fn figures(&self, html: &mut String) -> Result<(), Error> {
        for (k, o) in self.comparison.orderings.iter().enumerate() {
            let shown = self.shown(o);
            let (apart, gain) = difference(&shown, &truth(o, &self.comparison).display(self.exposure))?;
            let truth_id = if o.of_layers { "layers" } else { "truth" };
            let a = data_uri(&shown)?;
            let d = data_uri(&apart)?;
            let name = &o.name;
            let _ = writeln!(
                html,
                "<figure class=\"flip\"><img src=\"{a}\" alt=\"{name}\"><h3>{name}</h3><button \
                 aria-pressed=\"true\">ordering</button><button data-of=\"{truth_id}\" aria-pressed=\"false\">truth</button><button \
                 data-of=\"d{k}\" aria-pressed=\"false\">difference x {gain}</button><img hidden id=\"d{k}\" alt=\"\" src=\"{d}\"></figure>"
            );
        }
        Ok(())
    }
}

/// What an ordering is judged by.
fn truth<'a>(o: &Ordered, comparison: &'a Comparison) -> &'a Image<Linear> {
    comparison.layers.as_ref().ok().filter(|_| o.of_layers).unwrap_or(&comparison.truth)
}

/// How much an ordering pops, or `none`.
fn pops(o: &Ordered, none: &str) -> String {
    o.pop.map_or_else(|| none.to_owned(), |pop| format!("{pop:.2}"))
}

/// What the seeds of a random technique say, beside its name: the picture and its measures are those of the first one.
fn seeds(o: &Ordered) -> String {
    let Some(s) = &o.sampled else { return String::new() };
    let bias = s.bias.map_or_else(|| "none at 95 %".into(), |b| format!("{b:.1e}"));
    let mean = s.from_limit.mean;
    let half = s.from_limit.half_width;
    format!(" ({} seeds: RMSE {mean:.2e} ± {half:.0e}, bias {bias})", s.seeds)
}

/// Writes `orders.json`, `orders.csv`, `orders.html` and `orders.png`; each appears whole or not at all, and none before all
/// are made.
///
/// # Errors
/// As [`Target::write`], and [`Error::Internal`] if a picture cannot be encoded.
pub fn write(report: &OrdersReport, targets: &[Target; 4]) -> Result<(), Error> {
    let contents =
        [report.json().into_bytes(), report.csv().into_bytes(), report.html()?.into_bytes(), report.contact_sheet()?];
    Ok(targets.iter().zip(contents).try_for_each(|(target, bytes)| target.write(&bytes))?)
}
