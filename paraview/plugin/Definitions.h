// SPDX-License-Identifier: MIT OR Apache-2.0
/**
 * ParaView's own definitions of the proxies that Halite changes. They are taken from the ParaView that loads the plugin, and
 * given back with Halite in them, so that all else stays as that ParaView has it.
 */
#ifndef Definitions_h
#define Definitions_h

#include "vtkSmartPointer.h"

#include <map>
#include <string>

class vtkPVXMLElement;

class Definitions
{
public:
  Definitions();
  ~Definitions();

  /**
   * Takes what a server manager configuration says of those proxies; a later one replaces or extends an earlier one.
   */
  void Read(const std::string& xml);

  /**
   * A server manager configuration with Halite's mapper and those proxies, which have it. A proxy that is not known, or not of the form
   * that is expected, is left out, with a warning.
   */
  std::string WithHalite() const;

private:
  // By name; all are of the group "representations".
  std::map<std::string, vtkSmartPointer<vtkPVXMLElement>> Representations;
};

#endif
