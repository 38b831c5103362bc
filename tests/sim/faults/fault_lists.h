#pragma once
// The parts of faults_of().

#include "faults.h"

namespace cellcal::faults {

void add_line_faults(std::vector<Fault>& all, Wire wire);
void add_peer_faults(std::vector<Fault>& all, Wire wire);
void add_lies(std::vector<Fault>& all, Wire wire);
void add_device_faults(std::vector<Fault>& all, Wire wire);

}  // namespace cellcal::faults
