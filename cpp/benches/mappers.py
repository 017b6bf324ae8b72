import sys, time, statistics as st
from scene import *
from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkOpenGLProjectedTetrahedraMapper
import numpy as np
from vtkmodules.vtkCommonCore import vtkPoints, vtkIdTypeArray
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid
def big(n):
    ax=np.linspace(-1,1,n); z,y,x=np.meshgrid(ax,ax,ax,indexing='ij'); pts=np.stack([x,y,z],-1).reshape(-1,3)
    i=np.arange(n-1); k,j,i=np.meshgrid(i,i,i,indexing='ij'); b=(i+n*(j+n*k)).ravel()
    h=[b,b+1,b+1+n,b+n,b+n*n,b+1+n*n,b+1+n+n*n,b+n+n*n]
    t=np.stack([np.stack([h[q] for q in c],-1) for c in ((0,1,2,6),(0,2,3,6),(0,3,7,6),(0,7,4,6),(0,4,5,6),(0,5,1,6))],1).reshape(-1,4)
    g=vtkUnstructuredGrid(); p=vtkPoints(); p.SetData(numpy_support.numpy_to_vtk(pts.astype(np.float32),deep=1)); g.SetPoints(p)
    ca=vtkCellArray(); ca.SetData(numpy_support.numpy_to_vtkIdTypeArray(np.arange(0,t.size+1,4),deep=1), numpy_support.numpy_to_vtkIdTypeArray(t.ravel().astype(np.int64),deep=1)); g.SetCells(10,ca)
    s=np.sin(3*pts[:,0])*np.cos(2*pts[:,1])+0.5*np.sin(4*pts[:,2]+pts[:,0]); add(g,s); return g
for n in [int(a) for a in sys.argv[1:]]:
    g=big(n); kn=[(-1.5,0.3),(-.8,0),(-.2,0),(0,.6),(.2,0),(1.5,.4)]; col=[(-1.5,.1,.2,.9),(0,.9,.9,.3),(1.5,.9,.1,.1)]
    row={}
    ws={}
    for name,m in (("halite",vtkHaliteMapper()),("pt",vtkOpenGLProjectedTetrahedraMapper())):
        v=volume(g,kn,col,0.3,mapper=m); w=window((512,512)); w.SetOffScreenRendering(1); r=renderer(w,v,plane(-3)); look(r,position=(3.2,2.5,4.1),focus=(0,0,0),up=(0,1,0),clip=(1,12)); ws[name]=(w,r,m)
        t=time.time(); w.Render(); w.WaitForCompletion(); row[name]=[]; print(n, g.GetNumberOfCells(), name, "first %.0f ms"%(1e3*(time.time()-t)))
    parts=[]
    for k in range(7):
        for name,(w,r,m) in ws.items():
            r.GetActiveCamera().Azimuth(3); t=time.time(); w.Render(); w.WaitForCompletion(); row[name].append(1e3*(time.time()-t))
            if name=="halite": parts.append([1e3*x for x in (m.GetPrepareTime(),m.GetDepthTime(),m.GetCoreTime(),m.GetPresentTime())])
    print({k:"%.1f"%st.median(v) for k,v in row.items()}, "ratio %.1f"%(st.median(row["pt"])/st.median(row["halite"])), "prepare depth core present", ["%.2f"%st.median(c) for c in zip(*parts)])
    w,r,m=ws["halite"]; t=time.time(); w.Render(); print("still %.2f ms"%(1e3*(time.time()-t)), m.GetNumberOfFrames())
