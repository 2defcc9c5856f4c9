//! Where the MAVLink signing key is kept: the option, and what is in the file.

use super::RunError;
use crate::io::key_store::{KeptKey, KeyFile};

/// Options of signing.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct SigningArgs {
    /// Where the MAVLink signing key is kept, or none; with a key there signing is on [default: two-step/signing.key in the user's data folder]
    #[arg(long, value_name = "FILE|none")]
    pub signing_key: Option<KeyFile>,
}

impl SigningArgs {
    /// The key file and the key in it; `None` where no key is kept.
    ///
    /// # Errors
    /// [`RunError`] names the file and what is wrong with it.
    pub fn kept_key(&self) -> Result<Option<KeptKey>, RunError> {
        Ok(self.signing_key.clone().unwrap_or_default().read()?)
    }
}
