function legacy_minimal()
%LEGACY_MINIMAL Makes a block of the controller with the Legacy Code Tool instead of sf_minimal.c.
% The block advances when it gives its outputs: not for algebraic loops, where Simulink asks several times.
folder = fileparts(mfilename('fullpath'));
def = legacy_code('initialize');
def.SFunctionName = 'lct_minimal';
def.SampleTime = 0.0001;
def.InitializeConditionsFcnSpec = 'void minimal_block_init(double work1[4])';
def.OutputFcnSpec = 'void minimal_block_step(double work1[4], double u1[3], double y1[3])';
def.HeaderFiles = {'minimal_block.h'};
def.SourceFiles = {'minimal_block.c', 'minimal.c'};
def.IncPaths = {folder};
def.SrcPaths = {folder};
legacy_code('sfcn_cmex_generate', def);
legacy_code('compile', def);
legacy_code('sfcn_tlc_generate', def);
legacy_code('rtwmakecfg_generate', def);
end
