//! Laws whose calls are expensive, such as those in another language: one call for many contacts.

use concordem_contact::columns::Scalar;
use concordem_contact::law::{ContactLaw, Response};
use concordem_contact::step::Stepped;

use super::kinds::General;
use super::tile::{LOCAL, PendingContact, TileEvaluator};
use super::tile_map::is_local;
use super::{StepContext, Tile, Totals};

/// A contact in a step, which a [`BlockLaw`] responds to.
pub struct Moved<'a, L: ContactLaw> {
    /// The law with the parameters of the contact.
    pub law: &'a L,
    /// Its motion.
    pub kinematics: L::Kinematics,
    /// Its history before the step.
    pub history: L::State,
}

/// A law that responds to many contacts in one call.
pub trait BlockLaw: ContactLaw {
    /// Responses of contacts to a step of `dt` seconds, as [`ContactLaw::respond`] gives them one by one.
    fn respond_to_all(contacts: &[Moved<'_, Self>], dt: f64) -> Vec<Response<Self::State>>;
}

/// Evaluate the contacts of a tile between rigid particles, up to `size` in one call of the law.
pub fn evaluate_tile_in_blocks<L: BlockLaw>(
    context: &StepContext<'_>,
    rows: &[L],
    tile: Tile<'_, L>,
    size: usize,
) -> Totals {
    let (pairs, base, length) = (tile.pair, tile.base, tile.length);
    let mut evaluator = TileEvaluator::<L, General, Scalar>::new(context, rows, tile, Scalar);
    let mut next_slot = 0;
    for (first, block) in (0..).step_by(size).zip(pairs.chunks(size)) {
        let mut listed: Vec<PendingContact> = Vec::with_capacity(block.len());
        for (k, &pair) in (first..).zip(block) {
            let slot = if is_local(pair.b, base, length) {
                LOCAL
            } else {
                next_slot += 1;
                next_slot - 1
            };
            listed.extend(evaluator.begin(k, pair, slot));
        }
        if listed.is_empty() {
            continue;
        }
        let moved = |contact: &PendingContact| {
            let k = contact.contact as usize;
            let (motions, image) = (context.motions(contact.pair), evaluator.image(k));
            let before = evaluator.contact(k);
            let ends = context.ends(contact.pair, &motions, &image, false);
            let kinematics = ends.measure(&before, context.mode, context.dt);
            Moved { law: &rows[evaluator.tile.flags[k].row as usize], kinematics, history: before.history }
        };
        let moved: Vec<Moved<'_, L>> = listed.iter().map(moved).collect();
        let responses = L::respond_to_all(&moved, context.dt);
        assert_eq!(responses.len(), moved.len(), "a law in blocks responds to each contact once");
        let kinematics: Vec<L::Kinematics> = moved.iter().map(|contact| contact.kinematics).collect();
        for ((contact, kinematics), response) in listed.into_iter().zip(kinematics).zip(responses) {
            evaluator.commit(contact, &Stepped { kinematics, response });
        }
    }
    evaluator.totals
}
