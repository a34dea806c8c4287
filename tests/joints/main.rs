//! Smooth joints of the law `jointed`: closed forms of a contact, and YADE's JCFpm.

mod closed_forms;
mod gold;
