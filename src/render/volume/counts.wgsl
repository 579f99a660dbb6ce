// What the passes that count fibres in cells share with those that read them.
#define_import_path bevy_keratin::counts

// Cells count in parts of a fibre.
const UNIT: f32 = 65536.0;
// Cells next to a place that are left out on a way from there, half of the second one too.
const LEFT_OUT: f32 = 1.5;
