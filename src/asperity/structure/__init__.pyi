from .matrices import Structure as Structure
from .modes import CoupledMode as CoupledMode
from .modes import coupled_modes as coupled_modes
from .modes import settled_modes as settled_modes
from .receptance import coupled_receptance as coupled_receptance
from .receptance import share_of_receptance as share_of_receptance
from .receptance import transfer_of_roughness as transfer_of_roughness
