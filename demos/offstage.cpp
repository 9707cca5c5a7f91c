// The command line program; see producer/command_line.h.

#include "producer/command_line.h"

int main(int argc, char** argv) {
  return offstage::producer::run(argc, argv);
}
