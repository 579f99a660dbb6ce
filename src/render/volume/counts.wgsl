// What the passes that count fibres in cells share.
#define_import_path bevy_keratin::counts

// Cells count in parts of a fibre.
const UNIT: f32 = 65536.0;
