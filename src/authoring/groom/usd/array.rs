//! Values of attributes as numbers and texts.

use crate::authoring::groom::curve_sets::Numbers;
use openusd::sdf::Value;

/// Numbers of an attribute.
pub struct Array {
    numbers: Kind,
    /// How many make an element, such as 3 in `point3f[]`.
    pub each: usize,
}

enum Kind {
    Singles(Vec<f32>),
    Doubles(Vec<f64>),
}

impl Array {
    /// Those of a value, `None` for text and the like.
    pub fn of(value: Value) -> Option<Self> {
        macro_rules! exact {
            ($list:expr, $each:literal) => {
                (Kind::Singles(bytemuck::cast_slice(&$list).to_vec()), $each)
            };
        }
        macro_rules! doubles {
            ($list:expr, $each:literal) => {
                (Kind::Doubles(bytemuck::cast_slice(&$list).to_vec()), $each)
            };
        }
        macro_rules! numbers {
            ($list:expr) => {
                (Kind::Doubles($list.into_iter().map(|number| number as f64).collect()), 1)
            };
        }
        let (numbers, each) = match value {
            Value::FloatVec(list) => (Kind::Singles(list), 1),
            Value::DoubleVec(list) => (Kind::Doubles(list), 1),
            Value::IntVec(list) => numbers!(list),
            Value::UintVec(list) => numbers!(list),
            Value::Int64Vec(list) => numbers!(list),
            Value::Uint64Vec(list) => numbers!(list),
            Value::UcharVec(list) => numbers!(list),
            Value::BoolVec(list) => numbers!(list.into_iter().map(u8::from)),
            Value::HalfVec(list) => (Kind::Singles(list.into_iter().map(f32::from).collect()), 1),
            Value::Vec2fVec(list) => exact!(list, 2),
            Value::Vec3fVec(list) => exact!(list, 3),
            Value::Vec4fVec(list) => exact!(list, 4),
            Value::Vec2dVec(list) => doubles!(list, 2),
            Value::Vec3dVec(list) => doubles!(list, 3),
            Value::Vec4dVec(list) => doubles!(list, 4),
            Value::Vec2hVec(list) => {
                let all = list.into_iter().flat_map(|v| [v.x, v.y]);
                (Kind::Singles(all.map(f32::from).collect()), 2)
            }
            Value::Vec3hVec(list) => {
                let all = list.into_iter().flat_map(|v| [v.x, v.y, v.z]);
                (Kind::Singles(all.map(f32::from).collect()), 3)
            }
            Value::Bool(number) => (Kind::Doubles(vec![f64::from(u8::from(number))]), 1),
            Value::Int(number) => (Kind::Doubles(vec![f64::from(number)]), 1),
            Value::Uchar(number) => (Kind::Doubles(vec![f64::from(number)]), 1),
            Value::Uint(number) => (Kind::Doubles(vec![f64::from(number)]), 1),
            Value::Int64(number) => (Kind::Doubles(vec![number as f64]), 1),
            Value::Uint64(number) => (Kind::Doubles(vec![number as f64]), 1),
            Value::Half(number) => (Kind::Singles(vec![f32::from(number)]), 1),
            Value::Float(number) => (Kind::Singles(vec![number]), 1),
            Value::Double(number) => (Kind::Doubles(vec![number]), 1),
            Value::Vec2f(v) => exact!([v], 2),
            Value::Vec3f(v) => exact!([v], 3),
            Value::Vec4f(v) => exact!([v], 4),
            Value::Vec2d(v) => doubles!([v], 2),
            Value::Vec3d(v) => doubles!([v], 3),
            Value::Vec3h(v) => (Kind::Singles([v.x, v.y, v.z].map(f32::from).to_vec()), 3),
            _ => return None,
        };
        Some(Self { numbers, each })
    }

    pub fn iter(&self) -> impl Iterator<Item = f64> + Clone {
        (0..self.len()).map(|i| self.get(i))
    }
}

impl Numbers for &Array {
    fn len(self) -> usize {
        match &self.numbers {
            Kind::Singles(list) => list.len(),
            Kind::Doubles(list) => list.len(),
        }
    }

    fn get(self, i: usize) -> f64 {
        match &self.numbers {
            Kind::Singles(list) => list.get(i).map_or(f64::NAN, |number| f64::from(*number)),
            Kind::Doubles(list) => list.get(i).copied().unwrap_or(f64::NAN),
        }
    }
}

/// The texts of a value; none where it has numbers.
pub fn texts(value: Value) -> Vec<String> {
    match value {
        Value::String(text) => vec![text],
        Value::Token(text) => vec![text.as_str().to_owned()],
        Value::StringVec(texts) => texts,
        Value::TokenVec(texts) => texts.iter().map(|text| text.as_str().to_owned()).collect(),
        _ => Vec::new(),
    }
}
