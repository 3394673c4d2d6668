//! Temporary.
use convert::read::{Loaded, ReadParams, file};
fn main() {
    for path in std::env::args().skip(1) {
        let start = std::time::Instant::now();
        match file(path.as_ref(), &ReadParams::default(), None) {
            Err(e) => println!("{e}"),
            Ok((loaded, notes)) => {
                println!("{path}: {:?} {notes:?}", start.elapsed());
                let (o, p, n, c, t) = match loaded {
                    Loaded::Mesh(m) => (m.origin, m.position, m.normal, m.color, m.triangles),
                    Loaded::Points(m) => (m.origin, m.position, m.normal, m.color, vec![]),
                    _ => continue,
                };
                println!("{} vertices {} normals {} colours {} triangles", p.len(), n.len(), c.len(), t.len());
                let mut out = String::new();
                for (i, p) in p.iter().enumerate() {
                    let p = o + p.as_dvec3();
                    let c = c.get(i).copied().unwrap_or([0.7; 3]);
                    let n = n.get(i).copied().unwrap_or_default();
                    out += &format!("v {} {} {} {} {} {} {} {} {}\n", p.x, p.y, p.z, c[0], c[1], c[2], n.x, n.y, n.z);
                }
                for t in t {
                    out += &format!("f {} {} {}\n", t[0], t[1], t[2]);
                }
                std::fs::write(format!("{path}.dump"), out).unwrap();
            }
        }
    }
}
