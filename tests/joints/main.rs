//! Smooth joints of the law `jointed`: closed forms of a contact, YADE's JCFpm, and jointed specimens.

mod closed_forms;
mod gold;
mod rock;
