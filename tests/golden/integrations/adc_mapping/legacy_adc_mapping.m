function legacy_adc_mapping()
%LEGACY_ADC_MAPPING Makes a block of the controller with the Legacy Code Tool instead of sf_adc_mapping.c.
% The block advances when it gives its outputs: not for algebraic loops, where Simulink asks several times.
folder = fileparts(mfilename('fullpath'));
def = legacy_code('initialize');
def.SFunctionName = 'lct_adc_mapping';
def.SampleTime = 2e-5;
def.InitializeConditionsFcnSpec = 'void adc_mapping_block_init(double work1[7], double p1[4])';
def.OutputFcnSpec = 'void adc_mapping_block_step(double work1[7], double u1[3], double p1[4], double y1[3])';
def.HeaderFiles = {'adc_mapping_block.h'};
def.SourceFiles = {'adc_mapping_block.c', 'adc_mapping.c'};
def.IncPaths = {folder};
def.SrcPaths = {folder};
legacy_code('sfcn_cmex_generate', def);
legacy_code('compile', def);
legacy_code('sfcn_tlc_generate', def);
legacy_code('rtwmakecfg_generate', def);
end
