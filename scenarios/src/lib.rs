//! What is tested: recordings, lane changes, parameter distributions, sampling designs and the scenario library.
