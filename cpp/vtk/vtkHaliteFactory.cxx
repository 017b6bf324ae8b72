// SPDX-License-Identifier: MIT OR Apache-2.0
// How a mapper of this module comes to be where VTK's own is asked for.
#include "vtkHaliteCompatibility.h"
#include "vtkHaliteMapper.h"

#include "vtkObjectFactory.h"
#include "vtkObjectFactoryCollection.h"
#include "vtkVersion.h"

#include <cstring>
#include <vtksys/SystemTools.hxx>

VTK_ABI_NAMESPACE_BEGIN

namespace
{

const char* const Base = "vtkProjectedTetrahedraMapper";
const char* const Ours = "vtkHaliteMapper";
const char* const Theirs = "vtkOpenGLProjectedTetrahedraMapper";

VTK_CREATE_CREATE_FUNCTION(vtkHaliteMapper);

bool IsWanted()
{
  std::string value;
  return !vtksys::SystemTools::GetEnv("HALITE_OVERRIDE", value) || value != "0";
}

}

class vtkHaliteFactory : public vtkObjectFactory
{
public:
  static vtkHaliteFactory* New();
  vtkTypeMacro(vtkHaliteFactory, vtkObjectFactory);

  const char* GetVTKSourceVersion() VTK_FUTURE_CONST override { return VTK_SOURCE_VERSION; }
  const char* GetDescription() VTK_FUTURE_CONST override
  {
    return "Halite, exact volume rendering of unstructured grids";
  }

protected:
  vtkHaliteFactory()
  {
    this->RegisterOverride(Base, Ours, "Halite", IsWanted() ? 1 : 0, vtkObjectFactoryCreatevtkHaliteMapper);
  }

private:
  vtkHaliteFactory(const vtkHaliteFactory&) = delete;
  void operator=(const vtkHaliteFactory&) = delete;
};

vtkStandardNewMacro(vtkHaliteFactory);

namespace
{

vtkObjectFactory* FindFactory()
{
  vtkObjectFactoryCollection* factories = vtkObjectFactory::GetRegisteredFactories();
  vtkCollectionSimpleIterator at;
  factories->InitTraversal(at);
  while (vtkObjectFactory* factory = factories->GetNextObjectFactory(at))
  {
    if (factory->HasOverride(Base, Ours))
    {
      return factory;
    }
  }
  return nullptr;
}

}

void vtkHaliteMapper::SetOverride(bool on)
{
  if (on && !FindFactory())
  {
    vtkHaliteFactory* factory = vtkHaliteFactory::New();
    vtkObjectFactory::RegisterFactory(factory);
    factory->Delete();
  }
  vtkObjectFactory::SetAllEnableFlags(on, Base, Ours);
  // Of two that could answer, the one that was registered first would.
  vtkObjectFactory::SetAllEnableFlags(!on, Base, Theirs);
}

bool vtkHaliteMapper::GetOverride()
{
  vtkObjectFactory* factory = FindFactory();
  return factory && factory->GetEnableFlag(Base, Ours);
}

void vtkHaliteMapper::RegisterOverride()
{
  if (IsWanted())
  {
    vtkHaliteMapper::SetOverride(true);
  }
}

VTK_ABI_NAMESPACE_END

// What vtk_module_autoinit has programs call.
VTKHALITE_EXPORT void vtkHalite_AutoInit_Construct()
{
  static int count = 0;
  if (++count == 1)
  {
    vtkHaliteMapper::RegisterOverride();
  }
}

VTKHALITE_EXPORT void vtkHalite_AutoInit_Destruct() {}

// What VTK calls in libraries that it finds in VTK_AUTOLOAD_PATH.
VTK_FACTORY_INTERFACE_IMPLEMENT(vtkHaliteFactory);
