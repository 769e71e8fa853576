// Costs of the parts of a step, in about nanoseconds on one machine: only their ratios count, and only for decisions that change no
// contact (session_length.hpp, session_choice.hpp, and when a list is given up).
#pragma once

namespace trocar::collision::work {

inline constexpr double kBoxTest = 30.0; // a box against a node's children

// a step with what is kept
inline constexpr double kDriftVertex = 9.0;                    // of a cluster: its motion
inline constexpr double kVolume = 70.0;                        // of a cluster that begins a session, with its share of the nodes
inline constexpr double kNewPair = 100.0, kWaitingPair = 15.0; // pairs of clusters: found by a traversal; asleep
inline constexpr double kGap = 90.0, kSides = 60.0;           // pairs of clusters: boxes; planes between them
inline constexpr double kClusterBox = 320.0, kClusterBlocks = 450.0, kClusterHull = 590.0; // of a cluster, on demand
inline constexpr double kList = 1650.0, kCollected = 25.0; // a list of pairs of features, and for each that came near
inline constexpr double kLook = 110.0, kListed = 1.1, kBound = 25.0, kGiven = 30.0;
// a pair of clusters that is computed anew in a step: itself, and for each pair of features that would be collected for a list
inline constexpr double kAnew = 600.0, kAnewCollected = 6.0;

// a plain step
inline constexpr double kRefitVertex = 20.0, kRefitCluster = 550.0;
inline constexpr double kNeighbours = 600.0, kClusterPair = 200.0; // pairs of clusters that touch; others whose boxes come near
// either
inline constexpr double kElementaryTest = 28.0;

} // namespace trocar::collision::work
