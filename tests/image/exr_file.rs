//! An OpenEXR writer of the plainest kind: uncompressed scan lines of floats, and whatever a header may say.

type Value = Box<dyn Fn(i32, i32) -> f32>;

/// A file to be written.
pub(crate) struct Exr {
    /// First column and row, and the sizes, of the data window.
    data: [i32; 4],
    /// First and last column and row of the display window; none to leave it out.
    pub(crate) display: Option<[i32; 4]>,
    /// Names, samples per texel of rows and columns, and values by column and row in the file's coordinates.
    channels: Vec<(String, i32, Value)>,
    /// Rows from below.
    pub(crate) decreasing: bool,
    /// Whole attributes besides those that every file has.
    pub(crate) attributes: Vec<u8>,
}

pub(crate) fn attribute(name: &str, kind: &str, value: &[u8]) -> Vec<u8> {
    let size = (value.len() as u32).to_le_bytes();
    [name.as_bytes(), b"\0", kind.as_bytes(), b"\0", &size, value].concat()
}

fn ints(values: &[i32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

impl Exr {
    /// A picture that is stored as it is.
    pub(crate) fn of(width: i32, height: i32) -> Self {
        Self::cropped([0, 0, width, height], [0, 0, width, height])
    }

    /// Windows by first column, first row, width and height.
    pub(crate) fn cropped(data: [i32; 4], display: [i32; 4]) -> Self {
        let [left, top, width, height] = display;
        let display = Some([left, top, left + width - 1, top + height - 1]);
        Self { data, display, channels: Vec::new(), decreasing: false, attributes: Vec::new() }
    }

    pub(crate) fn channel(self, name: &str, value: impl Fn(i32, i32) -> f32 + 'static) -> Self {
        self.coarse_channel(name, 1, value)
    }

    /// A channel with a sample for every so many texels of a row and of a column.
    pub(crate) fn coarse_channel(mut self, name: &str, every: i32, value: impl Fn(i32, i32) -> f32 + 'static) -> Self {
        self.channels.push((name.to_owned(), every, Box::new(value)));
        self
    }

    /// The bytes; channels in the order given.
    pub(crate) fn write(&self) -> Vec<u8> {
        let [left, top, width, height] = self.data;
        let mut channels = Vec::new();
        for (name, every, _) in &self.channels {
            channels.extend([name.as_bytes(), b"\0", &ints(&[2, 0, *every, *every])].concat());
        }
        channels.push(0);
        let mut file = b"\x76\x2f\x31\x01\x02\0\0\0".to_vec();
        file.extend(attribute("channels", "chlist", &channels));
        file.extend(attribute("compression", "compression", &[0]));
        file.extend(attribute("dataWindow", "box2i", &ints(&[left, top, left + width - 1, top + height - 1])));
        if let Some(display) = self.display {
            file.extend(attribute("displayWindow", "box2i", &ints(&display)));
        }
        file.extend(attribute("lineOrder", "lineOrder", &[u8::from(self.decreasing)]));
        file.extend(&self.attributes);
        file.push(0);
        let mut lines: Vec<(i32, Vec<u8>)> = (top..top + height).map(|y| (y, self.line(y))).collect();
        let size = |line: &[u8]| line.len() as u64;
        let first = file.len() as u64 + 8 * lines.len() as u64;
        let all: u64 = lines.iter().map(|(_, line)| size(line)).sum();
        let mut place = if self.decreasing { first + all } else { first };
        for (_, line) in &lines {
            // The table goes from the top, whatever the order in the file.
            let at = if self.decreasing { place - size(line) } else { place };
            file.extend(at.to_le_bytes());
            place = if self.decreasing { at } else { place + size(line) };
        }
        if self.decreasing {
            lines.reverse();
        }
        lines.into_iter().for_each(|(_, line)| file.extend(line));
        file
    }

    fn line(&self, y: i32) -> Vec<u8> {
        let [left, _, width, _] = self.data;
        let mut samples = Vec::new();
        for (_, every, value) in self.channels.iter().filter(|(_, every, _)| y % every == 0) {
            let columns = (left..left + width).filter(|x| x % every == 0);
            samples.extend(columns.flat_map(|x| value(x, y).to_le_bytes()));
        }
        [ints(&[y, samples.len() as i32]), samples].concat()
    }
}
