//! Why a file is no recipe.

/// Why a file is no [`HairRecipe`](super::HairRecipe): where, what was found, and what was expected.
#[derive(thiserror::Error, Clone, Debug, PartialEq, Eq)]
#[error("line {line}, column {column}: {message}")]
pub struct RecipeError {
    /// The line, from 1.
    pub line: usize,
    /// The column, from 1.
    pub column: usize,
    /// What is wrong there.
    pub message: String,
}

impl From<ron::error::SpannedError> for RecipeError {
    fn from(error: ron::error::SpannedError) -> Self {
        let ron::error::Position { line, col } = error.span.start;
        // Bevy tells, too, in which of its types it was.
        let message = error.code.to_string();
        let message = message.split(" (stack: ").next().unwrap_or_default().to_owned();
        Self { line, column: col, message }
    }
}
