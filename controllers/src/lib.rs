//! Who drives: the ego stack (ACC, AEB, MIS) and the human drivers.
