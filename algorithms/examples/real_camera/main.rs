//! prototype
mod camera;
mod compare;
mod data;
mod measure;
mod simulate;
use measure::*;
use quadpixel::em::PixelStack;
use quadpixel::render::truth::{Defocus, ReceptiveField, TextureSpectrum};
use quadpixel::sensor::ShiftRule;
use std::path::Path;
fn main() -> Result<(), quadpixel::command::CommandError> {
    let args: Vec<String> = std::env::args().collect();
    let found = data::Captures::find(Path::new(&args[1]))?;
    if args.get(2).is_some_and(|a| a == "measure") {
        for f in &found.flats {
            let v = data::Views::read(&f.folder)?;
            let (w, h) = (v.left.width(), v.left.height());
            let parts = thirds(w, h);
            let s = both(shifts(&v.left, &v.right, &parts)?);
            println!("{} f{}: {s:.3?}", f.distance_mm, f.mark);
            // brightness ratio L/R by column sixths
            let mean = |im: &quadpixel::image::Image, k: usize| {
                let mut s = 0.0;
                let n = w / 6;
                for y in 0..h {
                    for x in k * n..(k + 1) * n {
                        s += im.pixel(x, y)[1] as f64;
                    }
                }
                s
            };
            println!(
                "  L/R {:.3?}",
                (0..6)
                    .map(|k| mean(&v.left, k) / mean(&v.right, k))
                    .collect::<Vec<_>>()
            );
        }
        let get = |m: f64| {
            found
                .flats
                .iter()
                .find(|f| f.distance_mm == 600.0 && f.mark == m)
                .map(|f| data::Views::read(&f.folder))
                .unwrap()
        };
        let (a, b) = (get(4.0)?, get(20.0)?);
        let parts = thirds(768, 512);
        println!(
            "mean F4 vs F20 (x_F4 - x_F20): {:.3?}",
            both(shifts(&a.mean(), &b.mean(), &parts)?)
        );
        println!(
            "L4-mean20 {:.3?} R4-mean20 {:.3?}",
            both(shifts(&a.left, &b.mean(), &parts)?),
            both(shifts(&a.right, &b.mean(), &parts)?)
        );
        println!("L20-mean4 {:.3?}", both(shifts(&b.left, &b.right, &parts)?));
    }
    if args.get(2).is_some_and(|a| a == "simulate" || a == "blur") {
        let get = |m: f64| {
            found
                .flats
                .iter()
                .find(|f| f.distance_mm == 600.0 && f.mark == m)
                .map(|f| data::Views::read(&f.folder))
                .unwrap()
        };
        let (real, sharp) = (get(4.0)?, get(20.0)?);
        if args.get(2).is_some_and(|a| a == "blur") {
            let get = |m: f64| {
                found
                    .flats
                    .iter()
                    .find(|f| f.distance_mm == 600.0 && f.mark == m)
                    .map(|f| data::Views::read(&f.folder))
                    .unwrap()
            };
            let (real, sharp) = (get(4.0)?, get(20.0)?);
            let name = "lib_50mm_US20210263286_ex1";
            let st = PixelStack::builtin("6um-dual").unwrap();
            let r = camera::wave(&st)?;
            let mean = sharp.mean();
            let rm = real.mean();
            let parts: Vec<Part> = (0..6)
                .map(|i| Part {
                    name: "",
                    x: 128 * i,
                    y: 128,
                    side: 128,
                })
                .chain((0..6).map(|i| Part {
                    name: "",
                    x: 128 * i,
                    y: 256,
                    side: 128,
                }))
                .collect();
            println!(
                "real {:.3?}",
                shifts(&real.left, &real.right, &parts)?
                    .iter()
                    .map(|s| s.whole_px)
                    .collect::<Vec<_>>()
            );
            for dist in [600.0, 630.0, 660.0, 700.0] {
                let l = camera::lens(name, 4.0)?;
                let l20 = camera::lens(name, 20.0)?;
                let cam = camera::camera(&l, &r, (768, 512), ShiftRule::ChiefRay)?;
                let c20 = camera::camera(&l20, &r, (768, 512), ShiftRule::ChiefRay)?;
                let v = simulate::rendered(&cam, &c20, &mean, dist)?;
                let (c, like) = compare::compare(&v, &real);
                let m = c.mean();
                // register by whole window first? report MSE by part of the mean
                let mse: Vec<f64> = parts
                    .iter()
                    .map(|p| {
                        let mut q = 0.0;
                        let mut n = 0.0;
                        for y in p.y..p.y + p.side {
                            for x in p.x.max(24)..(p.x + p.side).min(744) {
                                for c in 0..3 {
                                    let d = m.pixel(x, y)[c]
                                        - quadpixel::image::srgb::from_linear(rm.pixel(x, y)[c]);
                                    q += (d * d) as f64;
                                    n += 1.0;
                                }
                            }
                        }
                        -10.0 * (q / n as f64).log10()
                    })
                    .collect();
                println!(
                    "{dist} {like:?}\n psnr {mse:.1?}\n shift {:.3?}",
                    shifts(&v.left, &v.right, &parts)?
                        .iter()
                        .map(|s| s.whole_px)
                        .collect::<Vec<_>>()
                );
            }
            return Ok(());
        }
        let name = "lib_50mm_US20210263286_ex1";
        let mut st = PixelStack::builtin("6um-dual").unwrap();
        let n: Vec<f64> = args[3].split(',').map(|x| x.parse().unwrap()).collect();
        st.lens.radius_um = n[0];
        st.lens.height_um = st.sag_um() + 0.1;
        st.layer_mut("wiring").unwrap().thickness_um = n[1];
        let parts = thirds(768, 512);
        println!(
            "real {:.3?}",
            both(shifts(&real.left, &real.right, &parts)?)
        );
        let mean = sharp.mean();
        let mut coc = 0.0;
        for (name2, r) in [
            ("wave", camera::wave(&st)?),
            ("sharp", camera::sharp_split()?),
        ] {
            let l = camera::lens(name, 4.0)?;
            let l20 = camera::lens(name, 20.0)?;
            let cam = camera::camera(&l, &r, (768, 512), ShiftRule::ChiefRay)?;
            let c20 = camera::camera(&l20, &r, (768, 512), ShiftRule::ChiefRay)?;
            coc = Defocus::new(&cam)
                .unwrap()
                .circle_of_confusion_mm(600.0 - l.sensor_z_mm())
                / cam.sensor().pitch_mm();
            let t = std::time::Instant::now();
            let v = simulate::rendered(&cam, &c20, &mean, 600.0)?;
            println!("{name2} {:.1} s", t.elapsed().as_secs_f64());
            report(name2, &v, &real, &sharp, &parts)?;
        }
        report(
            "half disk",
            &simulate::half_disks(&mean, coc),
            &real,
            &sharp,
            &parts,
        )?;
        report("none", &sharp, &real, &sharp, &parts)?;
        return Ok(());
    }
    let name = "lib_50mm_US20210263286_ex1";
    for mark in [1.8, 2.8, 4.0, 5.6, 20.0] {
        let l = camera::lens(name, mark)?;
        let p = l.paraxial(550.0).unwrap();
        println!(
            "F/{mark}: EFL {:.3} F {:.3} sensor z {:.3} focus {:.3}",
            p.efl_mm,
            p.f_number,
            l.sensor_z_mm(),
            l.focus_distance_mm()
        );
    }
    let mut stacks = vec![("sharp".to_string(), camera::sharp_split()?)];
    for spec in &args[3..] {
        let n: Vec<f64> = spec.split(',').map(|x| x.parse().unwrap()).collect();
        let mut st = PixelStack::builtin("6um-dual").unwrap();
        st.lens.radius_um = n[0];
        st.lens.height_um = st.sag_um() + 0.1;
        st.layer_mut("wiring").unwrap().thickness_um = n[1];
        stacks.push((spec.clone(), camera::wave(&st)?));
    }
    for (name2, r) in &stacks {
        for mark in [4.0, 20.0] {
            let l = camera::lens(name, mark)?;
            let cam = camera::camera(&l, r, (768, 512), ShiftRule::ChiefRay)?;
            let d = Defocus::new(&cam).unwrap();
            for dist in [600.0, 800.0, 1000.0, 1500.0, 2000.0] {
                if mark == 20.0 && dist != 600.0 && dist != 1500.0 {
                    continue;
                }
                let depth = dist - l.sensor_z_mm();
                let coc = d.circle_of_confusion_mm(depth) / cam.sensor().pitch_mm();
                let mut line = format!("{name2} F/{mark} {dist}: coc {coc:.3} centroid,matched:");
                for col in [-256.0, -128.0, 0.0, 128.0, 256.0] {
                    let f = ReceptiveField::new(
                        &cam,
                        1,
                        cam.sensor().position_mm(383.5 + col, 255.5),
                        1024,
                    )
                    .unwrap();
                    line += &format!(
                        " {:.3},{:.3}",
                        f.centroid_shift_px(depth, [0, 1]),
                        f.matched_shift_px(
                            depth,
                            [0, 1],
                            &TextureSpectrum {
                                window_px: 31.0,
                                ..Default::default()
                            }
                        )
                    );
                }
                println!("{line}");
            }
        }
    }
    Ok(())
}

fn both(v: Vec<Shift>) -> Vec<[f64; 2]> {
    v.iter().map(|s| [s.whole_px, s.median_px]).collect()
}
fn report(
    name: &str,
    v: &data::Views,
    real: &data::Views,
    sharp: &data::Views,
    parts: &[Part],
) -> Result<(), quadpixel::command::CommandError> {
    let (c, like) = compare::compare(v, real);
    println!(
        "{name}: {like:?} shift {:.3?} mean vs f20 {:.3?} sim mean vs real mean {:.3?}",
        both(shifts(&v.left, &v.right, parts)?),
        both(shifts(&v.mean(), &sharp.mean(), parts)?),
        both(shifts(&v.mean(), &real.mean(), parts)?)
    );
    for (n, im) in [("l", &c.left), ("r", &c.right)] {
        let codes: Vec<u8> = im
            .data()
            .iter()
            .map(|x| (x * 255.0).round() as u8)
            .collect();
        quadpixel::image::raster::write_png8(
            std::path::Path::new(&format!("/tmp/canon_px/{}_{n}.png", name.replace(' ', "_"))),
            &codes,
            im.width(),
            im.height(),
            3,
        )
        .unwrap();
    }
    Ok(())
}
