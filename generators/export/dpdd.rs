//! DPDD (A. Abuolaim and M. S. Brown, ECCV 2020), the layout that most dual-pixel deblurring code reads:
//! `{train,val,test}_{c,l,r}/{source,target}/NAME.png`, 16-bit sRGB PNG, pairs by sorted order, read as
//! `cv2.imread(path, -1) / 65535`.

use std::path::Path;

use quadpixel::image::views::Side;

use super::error::ExportError;
use super::pictures;
use super::source::Sample;
use super::written::{Exported, put_png};

pub(super) const CONVENTIONS: &str = "NAME.png is 16-bit sRGB (code / 65535). c/source: the sum of all sub-pixels; l, r: the left and the right \
half of the pupil as the photographer sees it, times 2, so that c = (l + r) / 2 in linear light; target: all in focus, the same in c, l and r, \
registered to c. Pairs by sorted order.";

const FOLDERS: [(&str, Side); 3] = [("c", Side::All), ("l", Side::Left), ("r", Side::Right)];

pub(super) fn write(
    sample: &Sample<'_>,
    root: &Path,
    noisy: bool,
) -> Result<Exported, ExportError> {
    let (split, id) = (sample.entry.split.name(), &sample.entry.id);
    let target = pictures::sixteen_bit(id, &sample.target()?)?;
    let sides = FOLDERS.map(|(_, side)| side);
    let mut written = Exported::default();
    for ((folder, _), image) in FOLDERS.iter().zip(sample.parts(noisy, &sides)?) {
        let source = pictures::sixteen_bit(id, &image)?;
        for (kind, png) in [("source", &source), ("target", &target)] {
            let path = format!("{split}_{folder}/{kind}/{id}.png");
            written = written.plus(put_png(root, &path, png)?);
        }
    }
    Ok(written)
}
