// What the parts of a step cost, in nanoseconds or so on one machine: only their ratios count, and only for decisions that change no
// contact (session_length.hpp, session_choice.hpp, and when a list is given up).
#pragma once

namespace seldinger::collision::work {

inline constexpr double kBoxTest = 30.0; // a box against a node's children

// a step with what is kept
inline constexpr double kDriftVertex = 12.0;                 // of a cluster: its motion
inline constexpr double kVolume = 90.0;                      // of a cluster that begins a session, with its share of the nodes
inline constexpr double kNewPair = 100.0, kWaitingPair = 20.0; // pairs of clusters: found by a traversal; asleep
inline constexpr double kGap = 100.0, kSides = 80.0;         // pairs of clusters: boxes; planes between them
inline constexpr double kClusterBox = 430.0, kClusterBlocks = 600.0, kClusterHull = 780.0; // of a cluster, where somebody asks for them
inline constexpr double kList = 2200.0, kCollected = 45.0;   // a list of pairs of features, and for each that came near
inline constexpr double kLook = 150.0, kListed = 1.5, kBound = 45.0, kGiven = 40.0;
// a pair of clusters that is looked at anew in a step: itself, and for each pair of features that would be collected for a list
inline constexpr double kAnew = 900.0, kAnewCollected = 8.0;

// a plain step
inline constexpr double kRefitVertex = 20.0, kRefitCluster = 250.0;
inline constexpr double kClusterPair = 900.0;
// either
inline constexpr double kElementaryTest = 40.0;

} // namespace seldinger::collision::work
