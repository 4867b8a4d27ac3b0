//! Angles of a study that are done, on disk: a study that was killed goes on where it stopped.
//!
//! One line of JSON an angle, after a line that says what is studied; a file of another study is begun anew, a torn line is an angle not
//! done. Numbers come back to the bit. The file is removed once the study's own files are written.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use quadpixel::command::CommandError;
use quadpixel::response::PixelModel;
use serde::{Deserialize, Serialize};

use super::cases::Case;
use super::curve::Point;

/// The angles kept so far.
pub(super) struct Kept {
    path: PathBuf,
    file: Mutex<File>,
    done: BTreeMap<(usize, u64), Point>,
}

#[derive(Serialize, Deserialize)]
struct Line {
    case: usize,
    point: Point,
}

impl Kept {
    /// Opens or begins the file at `path` for these cases.
    pub fn open(path: PathBuf, cases: &[Case], model: &PixelModel) -> Result<Self, CommandError> {
        let failed =
            |e: &dyn std::fmt::Display| CommandError::failed(format!("{}: {e}", path.display()));
        let of: Vec<_> = cases
            .iter()
            .map(|c| (&c.name, &c.stack, c.wavelength_nm))
            .collect();
        let head = (model.version(), model, of);
        let head = serde_json::to_string(&head).map_err(|e| failed(&e))?;
        let text = std::fs::read(&path).unwrap_or_default();
        let text = String::from_utf8_lossy(&text);
        let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
        let mut lines = whole.lines();
        let known = lines.next() == Some(&head);
        let done: BTreeMap<_, _> = lines
            .filter(|_| known)
            .filter_map(|l| serde_json::from_str::<Line>(l).ok())
            .map(|l| ((l.case, l.point.theta_deg.to_bits()), l.point))
            .collect();
        let open = || -> std::io::Result<File> {
            let mut file = OpenOptions::new().create(true).append(true).open(&path)?;
            file.set_len(if known { whole.len() as u64 } else { 0 })?;
            if !known {
                file.write_all(format!("{head}\n").as_bytes())?;
            }
            Ok(file)
        };
        let file = Mutex::new(open().map_err(|e| failed(&e))?);
        Ok(Self { path, file, done })
    }

    /// Of a case at an angle, if it is done.
    pub fn point(&self, case: usize, theta_deg: f64) -> Option<Point> {
        self.done.get(&(case, theta_deg.to_bits())).copied()
    }

    /// Keeps an angle. One that cannot be kept is only computed again after a kill.
    pub fn keep(&self, case: usize, point: Point) {
        if let Ok(text) = serde_json::to_string(&Line { case, point }) {
            // A poisoned lock only means that another thread stopped; lines are written whole.
            let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
            let _ = file.write_all(format!("{text}\n").as_bytes());
        }
    }

    /// Forgets all, once the study is written.
    pub fn remove(self) {
        // One left over is only untidy.
        let _ = std::fs::remove_file(&self.path);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use quadpixel::em::PixelStack;

    fn case(name: &str) -> Vec<Case> {
        vec![Case {
            name: name.to_owned(),
            stack: PixelStack::builtin("1.6um").unwrap(),
            wavelength_nm: 550.0,
            centre_deg: 0.0,
            paper: None,
            chart: 0,
        }]
    }

    fn point(theta_deg: f64) -> Point {
        Point {
            theta_deg,
            left: 1.0 / 3.0,
            right: 0.1,
            total: 0.5,
            reflected: 0.2,
            warned: true,
        }
    }

    #[test]
    fn angles_of_a_killed_study_come_back_to_the_bit_and_those_of_another_do_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pitch.partial");
        let model = PixelModel::Geometric {
            focal_length_um: 2.0,
        };
        let open = |name: &str| Kept::open(path.clone(), &case(name), &model).unwrap();
        let kept = open("a");
        kept.keep(0, point(0.1 + 0.2));
        kept.keep(0, point(5.0));
        drop(kept);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 9]).unwrap();
        let kept = open("a");
        assert_eq!(kept.point(0, 0.1 + 0.2), Some(point(0.1 + 0.2)));
        assert_eq!(kept.point(0, 5.0), None);
        kept.keep(0, point(5.0));
        drop(kept);
        let kept = open("a");
        assert_eq!(kept.point(0, 5.0), Some(point(5.0)));
        drop(kept);
        let kept = open("b");
        assert_eq!(kept.point(0, 5.0), None);
        kept.remove();
        assert!(!path.exists());
    }
}
