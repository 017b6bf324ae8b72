// SPDX-License-Identifier: MIT OR Apache-2.0
// What ParaView loads.
#define PARAVIEW_BUILDING_PLUGIN
#define PARAVIEW_PLUGIN_BUILT_SHARED 1
#include "Definitions.h"
#include "halite_client_server.h"
#include "vtkHaliteMapper.h"

#include "vtkPVPlugin.h"
#include "vtkPVPluginLoader.h"
#include "vtkPVPluginTracker.h"
#include "vtkPVServerManagerPluginInterface.h"

namespace
{

const char* const Name = "Halite";

// ParaView must not close the library a second time.
struct Closing
{
  ~Closing() { vtkPVPluginLoader::PluginLibraryUnloaded(Name); }
} const closing;

}

class HalitePlugin
  : public vtkPVPlugin
  , public vtkPVServerManagerPluginInterface
{
public:
  HalitePlugin()
  {
    // What is linked takes the place of "Projected tetra", too, which stays what it says here.
    vtkHaliteMapper::SetOverride(false);
  }

  const char* GetPluginName() override { return Name; }
  const char* GetPluginVersionString() override { return HALITE_VERSION; }
  bool GetRequiredOnServer() override { return true; }
  bool GetRequiredOnClient() override { return true; }
  const char* GetRequiredPlugins() override { return ""; }
  const char* GetDescription() override { return "Exact volume rendering of grids"; }
  const char* GetEULA() override { return nullptr; }
  void GetBinaryResources(std::vector<std::string>&) override {}

  void GetXMLs(std::vector<std::string>& xmls) override
  {
    Definitions definitions;
    vtkPVPluginTracker* tracker = vtkPVPluginTracker::GetInstance();
    // As ParaView does: its own definitions first, then those of other plugins.
    for (const bool own : { true, false })
    {
      for (unsigned int i = 0; i < tracker->GetNumberOfPlugins(); ++i)
      {
        vtkPVPlugin* plugin = tracker->GetPlugin(i);
        auto source = dynamic_cast<vtkPVServerManagerPluginInterface*>(plugin);
        if (!source || plugin == this || own != (std::string(plugin->GetPluginName()) == "vtkPVInitializerPlugin"))
        {
          continue;
        }
        std::vector<std::string> texts;
        source->GetXMLs(texts);
        for (const std::string& text : texts)
        {
          definitions.Read(text);
        }
      }
    }
    xmls.push_back(definitions.WithHalite());
  }

  vtkClientServerInterpreterInitializer::InterpreterInitializationCallback GetInitializeInterpreterCallback() override
  {
    return halite_client_server_initialize;
  }
};

PV_PLUGIN_EXPORT(Halite, HalitePlugin)
